#include "layfigure/math/kernel.h"
#include "shorten.h"

namespace layfigure::dynamics {

LAYFIGURE_KERNEL
SolveReport base_step(const StepContext& context, const Plan<math::Lanes4>& plan,
                      std::vector<Node<math::Lanes4>>& nodes) {
  return base_step_of(context, plan, nodes);
}

double largest_turn(const Plan<math::Lanes4>& plan, const std::vector<Node<math::Lanes4>>& nodes) {
  return largest_turn_of(plan, nodes);
}

LAYFIGURE_KERNEL
SolveReport shorten(const StepContext& context, const Plan<math::Lanes4>& plan, std::vector<Node<math::Lanes4>>& nodes,
                    double part) {
  return shorten_of(context, plan, nodes, part);
}

}  // namespace layfigure::dynamics
