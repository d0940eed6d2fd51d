#pragma once

#include <string>

#include "stress_scene.h"

namespace layfigure::testing {

struct StressOutcome {
  /// What is wrong with the run; empty if nothing is. A failure is: a step that is not made, a state that is not finite
  /// or whose quaternions are not unit, a base step that breaks the energy ledger, bones of another length, a
  /// constraint's answer that is not finite or not one of its law, an overlap that grew by more than the bodies can
  /// have turned into each other.
  std::string failure;
  int steps{0};             ///< that were made
  int retried{0};           ///< steps made in shorter parts
  int taken_back{0};        ///< steps that energy was taken back in
  int unconverged{0};       ///< steps in which Newton's method did not meet its tolerance, reported and finite
  int unsolved{0};          ///< rows that contradict each other, or that the solver gave up on, reported and bounded
  double cpu_seconds{0.0};  ///< of the steps
};

[[nodiscard]] StressOutcome run(const StressScene& scene);

/// The smallest scene found that still fails, by leaving out bodies, loads, rows and steps.
[[nodiscard]] StressScene shrink(StressScene scene);

}  // namespace layfigure::testing
