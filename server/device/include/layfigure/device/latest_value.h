#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace layfigure::device {

/// Hands the newest value from one thread to another, without waiting on either side: what was not read in time is
/// overwritten. Three places take turns: the writer has one, the reader one, and the third is exchanged, a bit of it
/// telling whether it holds something new. Each call is one atomic exchange and one copy.
///
/// One thread writes, one reads. Allocates nothing.
template <class T>
class LatestValue {
  static_assert(std::is_trivially_copyable_v<T>, "a value must be plain data: it is copied while nobody looks");

 public:
  LatestValue() = default;
  LatestValue(const LatestValue&) = delete;
  LatestValue& operator=(const LatestValue&) = delete;

  /// The writer's.
  void write(const T& value) noexcept {
    places_[mine_] = value;
    mine_ = shared_.exchange(static_cast<std::uint8_t>(mine_ | kNew), std::memory_order_acq_rel) & kPlace;
  }

  /// The reader's: the newest value; false, and `value` as it was, where there is none since the last call.
  [[nodiscard]] bool read(T& value) noexcept {
    if ((shared_.load(std::memory_order_relaxed) & kNew) == 0) return false;
    theirs_ = shared_.exchange(theirs_, std::memory_order_acq_rel) & kPlace;
    value = places_[theirs_];
    return true;
  }

 private:
  static constexpr std::uint8_t kNew = 4;
  static constexpr std::uint8_t kPlace = 3;
  // The threads' own parts on cache lines of their own.
  static constexpr std::size_t kCacheLine = 64;

  std::array<T, 3> places_{};
  alignas(kCacheLine) std::uint8_t mine_{0};
  alignas(kCacheLine) std::uint8_t theirs_{1};
  alignas(kCacheLine) std::atomic<std::uint8_t> shared_{2};
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);
};

}  // namespace layfigure::device
