#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace layfigure::device {

/// The newest value, from one thread that puts to one that takes, neither of which ever waits: of three places each has
/// one, and the third goes to and fro between them.
template <class T>
class Latest {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  void put(const T& value) noexcept {
    places_[putting_] = value;
    putting_ = between_.exchange(static_cast<std::uint8_t>(putting_ | kFresh), std::memory_order_acq_rel) & kPlace;
  }

  /// False, and `value` untouched, if nothing was put since the last time.
  [[nodiscard]] bool take(T& value) noexcept {
    if ((between_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    taking_ = between_.exchange(taking_, std::memory_order_acq_rel) & kPlace;
    value = places_[taking_];
    return true;
  }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kPlace = 3;

  std::array<T, 3> places_{};
  std::uint8_t putting_{0};
  std::uint8_t taking_{1};
  std::atomic<std::uint8_t> between_{2};
};

}  // namespace layfigure::device
