#pragma once

#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"

/// A doll that is at rest as a whole under inputs that do not change.
namespace layfigure::dynamics {

/// The doll has been still through a step with these inputs; `loads`: one per body, or none. If the one before had the
/// same, the doll has come to rest: its momenta, which are next to none, end.
void rest_if_undisturbed(const Inputs& inputs, std::span<const BodyForce> loads, State& state);

/// Whether a step of the resting doll changes nothing. Where not, the rest has ended.
[[nodiscard]] bool keeps_resting(const Inputs& inputs, std::span<const BodyForce> loads, State& state);

}  // namespace layfigure::dynamics
