#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace layfigure::haptics {

/// Of the monotonic clock [ns].
[[nodiscard]] std::int64_t now_ns() noexcept;

/// What the system let a thread have.
struct RealtimeGrant {
  bool scheduled{false};      ///< SCHED_FIFO: nothing but other real-time threads and interrupts comes first
  bool memory_locked{false};  ///< no page of the process is ever fetched from disk
  std::string refused;        ///< one line that tells what was refused and how to allow it; empty if nothing was
};

/// Asks for SCHED_FIFO for the calling thread, and for all memory of the process to stay in RAM. What is not permitted
/// is left as it was, and told. `priority`: 1 to 99.
[[nodiscard]] RealtimeGrant request_realtime(int priority);

/// How well the ticks of a loop kept their times.
struct TickStatistics {
  std::uint64_t ticks{0};    ///< that were run
  std::uint64_t late{0};     ///< that began after the next one was due
  std::uint64_t skipped{0};  ///< that were dropped to catch up
  double worst_delay{0.0};   ///< of a tick's beginning after its time [s]
};

/// The times at which the ticks of a loop are due: multiples of the period after the start, so that delays do not add
/// up. A loop that falls behind drops ticks instead of running several in a row. Nanoseconds of one clock.
class TickTimes {
 public:
  /// Throws std::invalid_argument if the rate is not within 1 to 100 000 per second.
  TickTimes(double rate_hz, std::int64_t start_ns);

  [[nodiscard]] std::int64_t due_ns() const { return due_ns_; }
  [[nodiscard]] double period() const { return static_cast<double>(period_ns_) * 1e-9; }

  /// A tick begins at `now`. Returns how many ticks were dropped before it, which it stands for as well.
  std::uint64_t begin(std::int64_t now_ns) noexcept;

  [[nodiscard]] const TickStatistics& statistics() const { return statistics_; }

 private:
  std::int64_t period_ns_;
  std::int64_t due_ns_;
  TickStatistics statistics_;
};

/// A thread that calls a function at a fixed rate, at absolute times of the monotonic clock, in real time where that is
/// permitted.
class RealtimeThread {
 public:
  static constexpr int kPriority = 80;  ///< above what a system's own threads mostly have, below its watchdogs

  /// `tick` is called with the time since the last call [s], a multiple of the period, and must not throw. Throws
  /// std::invalid_argument for a rate that TickTimes refuses. Waits until the thread knows what it was granted.
  RealtimeThread(double rate_hz, std::function<void(double)> tick);
  /// Ends after the tick that runs.
  ~RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  [[nodiscard]] const RealtimeGrant& grant() const { return grant_; }
  /// So far. Its numbers may be of neighbouring ticks.
  [[nodiscard]] TickStatistics statistics() const noexcept;

 private:
  void run(TickTimes times, const std::function<void(double)>& tick);

  RealtimeGrant grant_;
  std::atomic<bool> granted_{false};
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<std::uint64_t> late_{0};
  std::atomic<std::uint64_t> skipped_{0};
  std::atomic<double> worst_delay_{0.0};
  std::thread thread_;
};

}  // namespace layfigure::haptics
