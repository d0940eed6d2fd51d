#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace layfigure::device {

/// What a LatestValue may carry: plain data, or a type that says by `static constexpr bool kCopiesPlainly = true` that
/// its copies allocate, lock and throw nothing, as those of vectors of fixed size do.
template <class T>
concept PlainValue = std::is_trivially_copyable_v<T> || requires {
  requires T::kCopiesPlainly;
};

/// Hands the newest value from one thread to another, without waiting on either side: what was not read in time is
/// overwritten. Three places take turns: the writer has one, the reader one, and the third is exchanged, a bit of it
/// telling whether it holds something new. A call is one atomic exchange and, but for take(), one copy.
///
/// One thread writes, one reads. Allocates nothing.
template <PlainValue T>
class LatestValue {
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
    const T* newest = take();
    if (newest == nullptr) return false;
    value = *newest;
    return true;
  }

  /// The same without a copy: the newest value, which stays until the next call; null where there is none.
  [[nodiscard]] const T* take() noexcept {
    if (!has_new()) return nullptr;
    theirs_ = shared_.exchange(theirs_, std::memory_order_acq_rel) & kPlace;
    return &places_[theirs_];
  }

  /// Whether the reader would find something.
  [[nodiscard]] bool has_new() const noexcept { return (shared_.load(std::memory_order_relaxed) & kNew) != 0; }

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
