#include "base_step.h"

// Compiled once per instruction set, chosen when the program loads. None uses fused multiply-adds, so all give the same
// bits. The thread sanitizer is not ready yet when the choice is made, so its build has one version.
#ifdef __SANITIZE_THREAD__
#define LAYFIGURE_KERNEL
#else
#define LAYFIGURE_KERNEL __attribute__((flatten, target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#endif

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
