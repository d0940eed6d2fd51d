#include "port_factors.h"

#include "base_step.h"
#include "layfigure/math/kernel.h"

namespace layfigure::dynamics {
namespace {

/// `gain` on axes that are rigid, `rest` on the others: a lock is no spring.
template <class T>
inline Vec3<T> unless_rigid(const Vec3<T>& stiffness, const Vec3<T>& gain, const Vec3<T>& rest) {
  const auto one = [](const T& k, const T& a, const T& b) { return math::select(k >= T(kRigidStiffness), a, b); };
  return {one(stiffness.x, gain.x, rest.x), one(stiffness.y, gain.y, rest.y), one(stiffness.z, gain.z, rest.z)};
}

template <class T>
inline void eliminate_with_of(GainPart part, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  const int slots = plan.schedule.size();
  for (int slot = 0; slot < slots; ++slot) {
    Node<T>& node = nodes[slot];
    const Constants<T>& body = plan.constants[slot];
    node.held = node.driven = false;
    Vec3<T> rest{};
    if (part == GainPart::kDamping) {
      rest = node.elastic ? body.damping : math::select(node.linearized.flowing > T(0.0), node.law.gain, body.damping);
    }
    node.law.gain = unless_rigid(body.stiffness, node.law.gain, rest);
  }
  for (int slot = slots - 1; slot >= 0; --slot) eliminate_joints(plan, nodes, slot);
}

}  // namespace

LAYFIGURE_KERNEL
void eliminate_with(GainPart part, const Plan<double>& plan, std::vector<Node<double>>& nodes) {
  eliminate_with_of(part, plan, nodes);
}

LAYFIGURE_KERNEL
void eliminate_with(GainPart part, const Plan<math::Lanes4>& plan, std::vector<Node<math::Lanes4>>& nodes) {
  eliminate_with_of(part, plan, nodes);
}

}  // namespace layfigure::dynamics
