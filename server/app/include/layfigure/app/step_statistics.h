#pragma once

#include <cstddef>
#include <vector>

namespace layfigure::app {

/// What one physics step cost.
struct StepCost {
  double cpu_us{0.0};   ///< of the stepping thread [us]
  double wall_us{0.0};  ///< [us]
};

struct StepSummary {
  double cpu_us_p50{0.0};
  double cpu_us_p99{0.0};
  double cpu_us_max{0.0};
  double realtime_factor{0.0};  ///< simulation seconds per wall-clock second spent stepping
};

/// The costs of the steps of the last second of simulation time. record() does not allocate.
class StepStatistics {
 public:
  /// `physics_hz` steps make a second of simulation time.
  explicit StepStatistics(double physics_hz);
  void record(const StepCost& cost);
  /// All zero before the first step. O(physics_hz).
  [[nodiscard]] StepSummary summary() const;

 private:
  double step_us_;
  std::size_t capacity_;
  std::size_t next_{0};
  std::vector<StepCost> costs_;  // a ring once it is full
};

}  // namespace layfigure::app
