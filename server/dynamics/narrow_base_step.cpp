#include "layfigure/math/kernel.h"
#include "shorten.h"

/// The base step of one body after the other: base_step.cpp beside it is that of packs. A file of its own, since it is
/// compiled with other options (CMakeLists.txt).
namespace layfigure::dynamics {

LAYFIGURE_KERNEL
SolveReport base_step(const StepContext& context, const Plan<double>& plan, std::vector<Node<double>>& nodes) {
  return base_step_of(context, plan, nodes);
}

double largest_turn(const Plan<double>& plan, const std::vector<Node<double>>& nodes) {
  return largest_turn_of(plan, nodes);
}

LAYFIGURE_KERNEL
SolveReport shorten(const StepContext& context, const Plan<double>& plan, std::vector<Node<double>>& nodes,
                    double part) {
  return shorten_of(context, plan, nodes, part);
}

}  // namespace layfigure::dynamics
