#include "constraint_set.h"

namespace layfigure::dynamics {

namespace {

bool goes_on(const Copy& copy) { return copy.constrained && !copy.settled; }

}  // namespace

template <class T>
void begin_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy) {
  context.copies[copy].constraints->gather(context, plan, nodes, copy);
}

void renew_constraints(const StepContext& context) {
  for (Copy& copy : context.copies) {
    if (goes_on(copy)) copy.constraints->renew();
  }
}

template <class T>
bool solve_constraints(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  bool changed = false;
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    const Copy& copy = context.copies[k];
    if (goes_on(copy) && copy.constraints->solve(context, plan, nodes, k)) changed = true;
  }
  return changed;
}

template <class T>
void finish_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    const Copy& copy = context.copies[k];
    if (!copy.constrained) copy.constraints->clear();
    copy.constraints->finish(context, plan, nodes, k);
  }
}

template <class T>
void measure_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    if (goes_on(context.copies[k])) context.copies[k].constraints->measure(plan, nodes, k);
  }
}

double constraint_slope(const Copy& copy) { return copy.constrained ? copy.constraints->slope(copy.fraction) : 0.0; }

void accept_constraints(const StepContext& context, bool first) {
  for (Copy& copy : context.copies) {
    if (goes_on(copy)) copy.constraints->accept(copy.fraction, first);
  }
}

#define LAYFIGURE_INSTANTIATE(T)                                                                         \
  template void begin_constraints(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&, int); \
  template bool solve_constraints(const StepContext&, const Plan<T>&, std::vector<Node<T>>&);            \
  template void finish_constraints(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&);     \
  template void measure_constraints(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&);
LAYFIGURE_INSTANTIATE(double)
LAYFIGURE_INSTANTIATE(math::Lanes4)
#undef LAYFIGURE_INSTANTIATE

}  // namespace layfigure::dynamics
