#pragma once

#include "workspace.h"

/// Aitken-Neville extrapolation of the base step over runs with 1, 2, .. sub-steps.
namespace layfigure::dynamics {

/// A stretch of time that a step covers.
struct Interval {
  double offset{0.0};  ///< of its beginning after the instant that the couplings' targets are given for [s]
  double length{0.0};  ///< [s]
};

/// What the loads are at `time`, for the copy's next sub-step from the bodies that it has been given.
void take_loads(const Loads& loads, double time, const RigidGroups& groups, Copy& copy);

/// Makes `order` runs from `state`, all over the whole interval: run k, in data.runs[k], has k + 1 sub-steps. All runs
/// of a thread's share (shares.h) that still have sub-steps to make, make them together. What a run comes to, bit for
/// bit, does not depend on the shares; but the work that it did is summed in the order of the slots.
[[nodiscard]] StepReport make_runs(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
                                   const Interval& interval, int order);

/// Combines runs 0 .. order - 1 in the place of the last.
void extrapolate(Workspace::Data& data, int order);

/// Makes the bodies of run order - 1 those of the state, `length` later, and completes the report.
void take_result(Workspace::Data& data, int order, double length, State& state, StepReport& report);

/// What the combination of order `order` and the next lower one differ by: the largest rotation of a joint [rad]. An
/// estimate of the lower one's error. Call before extrapolate().
[[nodiscard]] double extrapolation_error(const Workspace::Data& data, int order);

}  // namespace layfigure::dynamics
