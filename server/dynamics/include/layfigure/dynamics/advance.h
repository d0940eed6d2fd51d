#pragma once

#include "layfigure/dynamics/step.h"

namespace layfigure::dynamics {

struct AdvanceOptions {
  double tolerance{1e-5};      ///< of the error estimate of each step: the largest rotation of a joint [rad], > 0
  double smallest_step{1e-7};  ///< [s], > 0; a step this short is accepted whatever its error
  double impact_step{1e-3};    ///< [s], > 0; so is this one if contacts, ties or limits begin or end to act in it
  double largest_step{0.1};    ///< [s]
  int most_solves{0};          ///< budget of the call, in solves as of AdvanceReport::run_solves; 0: none
};

/// What the controller learnt, to go on with: pass it to the next advance().
struct StepSize {
  double step{1e-3};  ///< h to try first [s], > 0
  int order{2};       ///< 2 to kMaxOrder
};

struct AdvanceReport {
  StepStatus status{StepStatus::kOk};
  int steps{0};
  int rejected{0};            ///< steps that were made again shorter, for their error or because they were not finite
  int solves{0};              ///< as StepReport::solves, with those of rejected steps
  int run_solves{0};          ///< as StepReport::run_solves, with those of rejected steps
  int yielding{0};            ///< joints that flowed in the last step
  bool converged{true};       ///< every Newton iteration met its tolerance
  double largest_error{0.0};  ///< among the estimates of the accepted steps [rad]; base steps have none
  bool fell_short{false};     ///< the budget made steps longer than the tolerance allows, or base steps
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
/// With a budget, the step that the tolerance asks for is made while the budget lasts for as many of its like as reach
/// the end, and for one solve more. Where it does not, what is left of it is spent evenly: m_q steps of order q fit, of
/// length H_q = left / m_q; their errors promise to add up to m_q err_q (H_q / h)^q, with err_q those of the call's
/// last step, of length h, and the order that promises least is taken. Before there is an estimate, that is the order
/// that the tolerance asks for, or the highest below it that fits; base steps if none does, or after a step that was
/// not finite. So a real-time loop gets the best accuracy for its time: the budget is the frame's CPU time over that of
/// a solve. It counts solves, not time, so the same inputs still give the same bits.
///
/// The budget is kept where each sub-step takes one solve. How often Newton's method will iterate is taken from the
/// step before, so where joints flow, constraints act or a base step has to be made in parts, the call may exceed the
/// budget by what one step takes more than that, and by one base step that then ends the call.
///
/// The couplings' targets move from the beginning of the whole advance on. Cost, errors, allocation and thread-safety
/// as step(); on a status other than kOk the state is that of the last good step.
[[nodiscard]] AdvanceReport advance(const Model& model, State& state, Workspace& workspace, const Inputs& inputs,
                                    double duration, const AdvanceOptions& options, StepSize& size);

}  // namespace layfigure::dynamics
