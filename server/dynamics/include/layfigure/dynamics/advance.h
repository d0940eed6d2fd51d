#pragma once

#include "layfigure/dynamics/step.h"

namespace layfigure::dynamics {

struct AdvanceOptions {
  double tolerance{1e-5};      ///< of the error estimate of each step: the largest rotation of a joint [rad], > 0
  double smallest_step{1e-7};  ///< [s], > 0; a step this short is accepted whatever its error
  double impact_step{1e-3};    ///< [s], > 0; so is this one if contacts, ties or limits begin or end to act in it
  double largest_step{0.1};    ///< [s]
};

/// What the controller learnt, to go on with: pass it to the next advance().
struct StepSize {
  double step{1e-3};  ///< h to try first [s], > 0
  int order{2};       ///< 2 to kMaxOrder
};

struct AdvanceReport {
  StepStatus status{StepStatus::kOk};
  int steps{0};
  int rejected{0};  ///< steps that were made again shorter, for their error or because they were not finite
  int solves{0};
  int yielding{0};               ///< joints that flowed in the last step
  bool converged{true};          ///< every Newton iteration met its tolerance
  double largest_error{0.0};     ///< among the estimates of the accepted steps [rad]
  ConstraintReport constraints;  ///< of the last step
  Work work;
};

/// Advances `state` by `duration` [s] with as many steps as the tolerance asks for, choosing length and order of each.
///
/// A step of order p makes runs of 1, 2, .. p sub-steps; the combinations of order q and q - 1 of the first q of them
/// differ by the error estimate err_q for every q from 2 to p. With it the length for order q that just meets the
/// tolerance is  h_q = 0.9 h (tolerance / err_q)^(1/q),  and the order with the most length for its solves, h_q / (q (q
/// + 1) / 2), is taken next (Deuflhard 1983, "Order and stepsize control in extrapolation methods"; Hairer & Wanner II,
/// IV.9). Where a joint begins or ends to flow the torque has a kink, which the estimate finds: there the steps get
/// short.
///
/// Where contacts, ties or limits begin or end to act no order helps: a step of at most `impact_step` over such an
/// instant is taken as the base steps of its finest run. The contacts are those of the beginning of the whole advance.
///
/// The couplings' targets move from the beginning of the whole advance on. Cost, errors, allocation and thread-safety
/// as step(); on a status other than kOk the state is that of the last good step.
[[nodiscard]] AdvanceReport advance(const Model& model, State& state, Workspace& workspace, const Inputs& inputs,
                                    double duration, const AdvanceOptions& options, StepSize& size);

}  // namespace layfigure::dynamics
