#pragma once

#include <chrono>

namespace layfigure::messaging {

/// A token bucket: `rate` events a second, and `burst` of them at once after a rest. Time is passed in. Not
/// thread-safe.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  /// Full at first. Both > 0; `burst` >= 1.
  RateLimit(double rate, double burst) : rate_(rate), burst_(burst), tokens_(burst) {}

  /// True if one more event is within the limit at `now`, and then counts it.
  [[nodiscard]] bool take(Clock::time_point now);
  /// When take() will be true again; `now` if it is.
  [[nodiscard]] Clock::time_point ready_at(Clock::time_point now) const;

 private:
  [[nodiscard]] double tokens_at(Clock::time_point now) const;

  double rate_;
  double burst_;
  double tokens_;
  Clock::time_point counted_at_{};
};

}  // namespace layfigure::messaging
