#pragma once

#include "extrapolation.h"

/// Base steps that keep the energy ledger (step.h): none ends with more energy than it began with and was given.
namespace layfigure::dynamics {

/// Covers the interval with base steps, in data.runs[0] and copies[0]: one, or shorter ones where that one does not
/// hold, in up to 2^kHalvings parts.
///
/// The projection at the old configuration cannot create energy. Neither can the springs of the joints: an anisotropic
/// one moves its strain's rotation vector by h u, so that its energy is the quadratic function that the implicit law
/// took it for; an isotropic one moves by h w on the rotations, whose squared distances grow less than those of flat
/// space (Toponogov). But the bodies turn and move on with their momenta, and that can create energy in the second
/// order of h:
///   - a body that keeps its angular momentum L while it turns off its principal axes gains (h w x L) I^-1 (h w x L) /
///     2. The ledger takes the excess back from the spins of those bodies, never more than they gained;
///   - on the curved ways of the bodies, gravity, loads and couplings do not do the work that their impulses did. The
///     ledger takes the rest of the excess back from all momenta alike.
/// These corrections are of the second order in h too, so the step stays one of the first order. Where they would be a
/// large part of the kinetic energy, the step is made again in shorter parts, as it is where it is not finite or did
/// not converge. The shortest part may end early on its way, with velocities that are smaller alike: a line search
/// along the direction in which the energy falls, as in the minimisation that an implicit step is. For a way short
/// enough the energy cannot grow, because the loss is of the first order in its length and the gain of the second.
///
/// Under gravity alone a cheap bound (creation_bound.h) mostly shows that nothing was created; else the energies are
/// measured (balance.h).
[[nodiscard]] StepReport make_base_steps(const Model& model, const State& state, Workspace::Data& data,
                                         const Inputs& inputs, const Interval& interval);

/// What a step of this order is the result of: the runs that it extrapolates, or base steps.
[[nodiscard]] StepReport make_step(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
                                   const Interval& interval, int order);

}  // namespace layfigure::dynamics
