#pragma once

#include <chrono>
#include <cstdint>

namespace layfigure::app {

/// When each step of a realtime simulation is due, as absolute deadlines: step n at start + n / rate, computed from n,
/// so that no error adds up. Who falls behind by more than kMaxLag does not catch up (each late step would make the
/// next later still): the deadlines move, that simulation time is dropped, and it is counted.
class Pacer {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kMaxLag{100};

  /// The first step is due one period after `start`.
  Pacer(double rate_hz, Clock::time_point start);

  [[nodiscard]] Clock::time_point deadline() const;
  /// The next step begins at `now`.
  void begin_step(Clock::time_point now);
  /// Takes all steps that are due at `now` for done, without counting them as late: those of a doll at rest. Returns
  /// their number.
  std::int64_t pass_over(Clock::time_point now);
  /// Nothing is due before `now`: after a time in which no steps were wanted.
  void skip_to(Clock::time_point now);

  /// Steps that began more than a period after their deadline.
  [[nodiscard]] std::int64_t late_steps() const { return late_steps_; }
  /// Simulation time that was dropped [s].
  [[nodiscard]] double dropped_time() const { return std::chrono::duration<double>(dropped_).count(); }

 private:
  double period_ns_;
  Clock::time_point start_;
  std::int64_t next_step_{1};
  std::int64_t late_steps_{0};
  Clock::duration dropped_{};
};

}  // namespace layfigure::app
