#include "constraint_set.h"

namespace layfigure::dynamics {

template <class T>
void begin_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    context.copies[k].constraints->gather(context, plan, nodes, k);
  }
}

void renew_constraints(const StepContext& context) {
  for (Copy& copy : context.copies) copy.constraints->renew();
}

template <class T>
bool solve_constraints(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  bool changed = false;
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    if (context.copies[k].constraints->solve(context, plan, nodes, k)) changed = true;
  }
  return changed;
}

template <class T>
void finish_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, bool any) {
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    if (!any) context.copies[k].constraints->clear();
    context.copies[k].constraints->finish(context, plan, nodes, k);
  }
}

template <class T>
void measure_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    context.copies[k].constraints->measure(plan, nodes, k);
  }
}

double constraint_slope(const StepContext& context, double fraction) {
  double sum = 0.0;
  for (const Copy& copy : context.copies) sum += copy.constraints->slope(fraction);
  return sum;
}

void accept_constraints(const StepContext& context, double fraction, bool first) {
  for (Copy& copy : context.copies) copy.constraints->accept(fraction, first);
}

#define LAYFIGURE_INSTANTIATE(T)                                                                           \
  template void begin_constraints(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&);        \
  template bool solve_constraints(const StepContext&, const Plan<T>&, std::vector<Node<T>>&);              \
  template void finish_constraints(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&, bool); \
  template void measure_constraints(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&);
LAYFIGURE_INSTANTIATE(double)
LAYFIGURE_INSTANTIATE(math::Lanes4)
#undef LAYFIGURE_INSTANTIATE

}  // namespace layfigure::dynamics
