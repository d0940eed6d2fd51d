#include "base_step.h"
#include "kernel.h"

namespace layfigure::dynamics {

LAYFIGURE_KERNEL
SolveReport base_step(const StepContext& context, const Plan<double>& plan, std::vector<Node<double>>& nodes) {
  return base_step_of(context, plan, nodes);
}

LAYFIGURE_KERNEL
SolveReport base_step(const StepContext& context, const Plan<math::Lanes4>& plan,
                      std::vector<Node<math::Lanes4>>& nodes) {
  return base_step_of(context, plan, nodes);
}

}  // namespace layfigure::dynamics
