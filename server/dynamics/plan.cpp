#include "plan.h"

#include <cmath>

#include "axis_law.h"

namespace layfigure::dynamics {
namespace {

template <class T>
void set_mass(const RigidGroup& group, int k, Constants<T>& constants) {
  const auto& [moments, axes] = group.inertia;
  const auto dyad = [&](int axis) -> Eigen::Vector3d { return axes.col(axis) * std::sqrt(moments[axis] - moments[0]); };
  math::set_lane(constants.mass, k, group.mass);
  math::set_lane(constants.mount, k, group.mount);
  math::set_lane(constants.anchor, k, group.anchor);
  math::set_lane(constants.com, k, group.com);
  math::set_lane(constants.inertia, k, moments[0]);
  math::set_lane(constants.u, k, dyad(1));
  math::set_lane(constants.v, k, dyad(2));
  constants.mounted = constants.mounted || group.mounted;
}

template <class T>
void set_joint(const JointLaw& law, int k, Constants<T>& constants) {
  math::set_lane(constants.section, k, law.shape.axes);
  math::set_lane(constants.stiffness, k, axis_stiffness(law));
  math::set_lane(constants.damping, k, axis_damping(law));
  math::set_lane(constants.inverse_shape, k, axis_inverse_shape(law));
  math::set_lane(constants.flow_damping, k, law.flow_damping);
  math::set_lane(constants.yield, k, law.yield_torque);
  math::set_lane(constants.hardening, k, law.hardening);
  math::set_lane(constants.anisotropic, k, is_isotropic(law) ? 0.0 : 1.0);
  math::set_lane(constants.sectional, k, is_mild(law) ? 0.0 : 1.0);
  constants.flows = constants.flows || std::isfinite(law.yield_torque);
  constants.isotropic = constants.isotropic && is_isotropic(law);
  constants.uneven = constants.uneven || !is_mild(law);
}

template <class T>
void set_body(const RigidGroup& group, const BodyDefinition& body, RootKind root, int k, Constants<T>& constants) {
  const bool free = body.parent < 0 && root == RootKind::kFree;
  const bool fixed = body.parent < 0 && root == RootKind::kFixed;
  set_mass(group, k, constants);
  set_joint(free || fixed ? JointLaw{} : body.joint, k, constants);
  math::set_lane(constants.free, k, free ? 1.0 : 0.0);
  math::set_lane(constants.fixed, k, fixed ? 1.0 : 0.0);
  constants.roots = constants.roots || free || fixed;
  const bool limited = !free && !fixed && body.limits.any();
  math::set_lane(constants.unlimited, k, limited ? 0.0 : JointLimits::kInfinity);
  constants.limited = constants.limited || limited;
}

}  // namespace

template <class T>
void arrange(const Model& model, const RigidGroups& groups, const Levers& levers, Plan<T>& plan) {
  // An idle lane computes the motion of a unit ball that nothing reads.
  const RigidGroup idle = idle_group();
  const BodyDefinition unjointed;
  plan.schedule.arrange(groups.parents());
  plan.constants.resize(plan.schedule.size());
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    Constants<T>& constants = plan.constants[slot];
    constants.mounted = constants.based = constants.roots = constants.flows = constants.limited = false;
    constants.uneven = false;
    constants.isotropic = true;
    for (int k = 0; k < plan.schedule.lanes(); ++k) {
      const Task& task = plan.schedule.tasks(slot)[k];
      const bool none = task.idle;
      set_body(none ? idle : groups.group(task.body), none ? unjointed : model.body(task.body),
               none ? RootKind::kBall : model.root(), k, constants);
      if (none) {  // so that it never makes a slot mixed
        math::set_lane(constants.anisotropic, k, 1.0);
        math::set_lane(constants.sectional, k, 1.0);
      }
      constants.based = constants.based || (!none && task.parent_slot == plan.schedule.size());
      math::set_lane(constants.reported, k, !none && task.copy + 1 == plan.schedule.copies() ? 1.0 : 0.0);
    }
  }
  plan.limited.clear();
  plan.flowing.clear();
  for (const int i : groups.carriers()) {
    const bool jointed = model.body(i).parent >= 0 || model.root() == RootKind::kBall;
    if (jointed && model.body(i).limits.any()) plan.limited.push_back(i);
    if (jointed && std::isfinite(model.body(i).joint.yield_torque)) plan.flowing.push_back(i);
  }
  set_bounds(model, groups, levers, plan.schedule, plan.bounds);
}

template <class T>
Plan<T> make_plan(const Model& model, const RigidGroups& groups, const Levers& levers, int copies) {
  Plan<T> plan{.schedule = Schedule(groups.parents(), copies, math::LaneTraits<T>::kCount),
               .constants = {},
               .limited = {},
               .flowing = {},
               .bounds = {}};
  arrange(model, groups, levers, plan);
  return plan;
}

#define LAYFIGURE_INSTANTIATE(T)                                                    \
  template void arrange(const Model&, const RigidGroups&, const Levers&, Plan<T>&); \
  template Plan<T> make_plan(const Model&, const RigidGroups&, const Levers&, int);
LAYFIGURE_INSTANTIATE(double)
LAYFIGURE_INSTANTIATE(math::Lanes4)
#undef LAYFIGURE_INSTANTIATE

}  // namespace layfigure::dynamics
