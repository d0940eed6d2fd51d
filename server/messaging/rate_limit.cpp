#include "layfigure/messaging/rate_limit.h"

#include <algorithm>
#include <cmath>

namespace layfigure::messaging {

double RateLimit::tokens_at(Clock::time_point now) const {
  const double elapsed = std::chrono::duration<double>(now - counted_at_).count();
  return std::min(burst_, tokens_ + rate_ * std::max(0.0, elapsed));
}

bool RateLimit::take(Clock::time_point now) {
  const double tokens = tokens_at(now);
  if (tokens < 1.0) return false;
  tokens_ = tokens - 1.0;
  counted_at_ = std::max(now, counted_at_);
  return true;
}

RateLimit::Clock::time_point RateLimit::ready_at(Clock::time_point now) const {
  const double missing = std::max(0.0, 1.0 - tokens_at(now));
  return now + std::chrono::nanoseconds(static_cast<std::int64_t>(std::ceil(1e9 * missing / rate_)));
}

}  // namespace layfigure::messaging
