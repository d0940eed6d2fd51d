#include "path_factors.h"

#include "base_step.h"
#include "layfigure/math/kernel.h"

namespace layfigure::dynamics {
namespace {

template <class T>
inline SlotFactor<T> factor_of_slot(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot) {
  const Node<T>& node = nodes[slot];
  const T one(1.0), zero(0.0);
  const Mat3<T> identity{one, zero, zero, zero, one, zero, zero, zero, one};
  const Articulated<T> own = articulated_of(plan, nodes, slot);
  SlotFactor<T> factor{.own = own,
                       .axes = identity,
                       .motion = identity,
                       .A = own.A,
                       .G = gain_of(plan.constants[slot], node),
                       .X = {},
                       .H = own.H};
  if (node.in_section) {
    const auto sectional = node.sectional > T(0.0);
    factor.axes = math::select(sectional, node.axes, identity);
    factor.motion = math::select(sectional, motion_of(node), identity);
    const Mat3<T> Dt = transposed(factor.motion);
    factor.A = math::select(sectional, congruent(Dt, own.A), own.A);
    factor.H = math::select(sectional, Dt * own.H, own.H);
  }
  Sym3<T> AG = factor.A;
  AG += factor.G;
  factor.X = math::inverse(AG);
  return factor;
}

}  // namespace

LAYFIGURE_KERNEL
SlotFactor<double> factor_of(const Plan<double>& plan, const std::vector<Node<double>>& nodes, int slot) {
  return factor_of_slot(plan, nodes, slot);
}

LAYFIGURE_KERNEL
SlotFactor<math::Lanes4> factor_of(const Plan<math::Lanes4>& plan, const std::vector<Node<math::Lanes4>>& nodes,
                                   int slot) {
  return factor_of_slot(plan, nodes, slot);
}

}  // namespace layfigure::dynamics
