#include "layfigure/app/pacer.h"

#include <algorithm>

namespace layfigure::app {

Pacer::Pacer(double rate_hz, Clock::time_point start) : period_ns_(1e9 / rate_hz), start_(start) {}

Pacer::Clock::time_point Pacer::deadline() const {
  return start_ + std::chrono::nanoseconds(static_cast<std::int64_t>(period_ns_ * static_cast<double>(next_step_)));
}

void Pacer::begin_step(Clock::time_point now) {
  const Clock::duration lag = now - deadline();
  if (lag > std::chrono::duration<double, std::nano>(period_ns_)) ++late_steps_;
  if (lag > kMaxLag) {
    start_ += lag;
    dropped_ += lag;
  }
  ++next_step_;
}

std::int64_t Pacer::pass_over(Clock::time_point now) {
  if (now < deadline()) return 0;
  const auto elapsed = static_cast<double>(std::chrono::nanoseconds(now - start_).count());
  const std::int64_t next = std::max(next_step_, static_cast<std::int64_t>(elapsed / period_ns_)) + 1;
  const std::int64_t passed = next - next_step_;
  next_step_ = next;
  return passed;
}

void Pacer::skip_to(Clock::time_point now) {
  if (now > deadline()) start_ += now - deadline();
}

}  // namespace layfigure::app
