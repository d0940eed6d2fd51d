#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace layfigure::haptics {

/// Of the ticks of a loop since its start: how many, how late, and how long they took, in bins a quarter of an octave
/// wide. Plain data.
struct TickRecord {
  static constexpr int kBins = 72;
  static constexpr double kFirstBin = 1e-7;  ///< upper edge of the first [s]; that of the last: 22 ms
  static constexpr int kBinsPerOctave = 4;

  std::int64_t ticks{0};
  std::int64_t late{0};    ///< that began after the next one was due
  std::int64_t missed{0};  ///< that were not run, to catch up
  std::array<std::int64_t, kBins> durations{};

  /// A tick that took so long [s], `periods` after the one before.
  void add(double duration, int periods) noexcept;
};

/// Of the last second or two.
struct TickSummary {
  double rate_hz{0.0};  ///< ticks per second
  double us_p50{0.0};   ///< how long a tick took [us]: an upper bound, 19 % wide
  double us_p99{0.0};
  double us_max{0.0};
};

/// The newest part of a record that grows.
class TickWindow {
 public:
  static constexpr double kLength = 1.0;  ///< [s], and up to twice as much

  /// The record as it is at `time` [s].
  void update(const TickRecord& record, double time);
  [[nodiscard]] const TickRecord& whole() const { return newest_.record; }
  [[nodiscard]] TickSummary summary() const;

 private:
  struct Moment {
    TickRecord record;
    double time{0.0};
  };

  std::optional<Moment> begin_;  ///< of the window
  Moment middle_;                ///< the next beginning
  Moment newest_;
};

}  // namespace layfigure::haptics
