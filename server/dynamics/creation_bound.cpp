#include "creation_bound.h"

#include <algorithm>

#include "axis_law.h"

namespace layfigure::dynamics {
namespace {

template <class T>
void set_body(const Model& model, const RigidGroups& groups, int index, const Levers& levers, int k,
              BoundConstants<T>& bound) {
  const RigidGroup& group = groups.group(index);
  const bool jointed = group.parent >= 0;
  const bool ball = jointed || model.root() == RootKind::kBall;
  math::set_lane(bound.inverse_mass, k, 1.0 / group.mass);
  math::set_lane(bound.moment, k, levers.moments[index]);
  math::set_lane(bound.lever, k, levers.moments[index].norm());
  math::set_lane(bound.levers, k, levers.behind[index]);
  math::set_lane(bound.largest_moment, k, group.inertia.moments[2]);
  math::set_lane(bound.inverse_smallest, k, 1.0 / group.inertia.moments[0]);
  math::set_lane(bound.joint_weight, k, jointed ? 0.5 : 0.0);
  math::set_lane(bound.strain_weight, k, ball && !is_isotropic(model.body(index).joint) ? 0.25 : 0.0);
}

}  // namespace

Levers::Levers(const RigidGroups& groups)
    : carried(groups.parents().size()), moments(carried.size()), behind(carried.size()) {
  measure(groups);
}

void Levers::measure(const RigidGroups& groups) {
  std::fill(carried.begin(), carried.end(), 0.0);
  std::fill(behind.begin(), behind.end(), 0.0);
  std::fill(moments.begin(), moments.end(), Eigen::Vector3d::Zero());
  const std::vector<int>& carriers = groups.carriers();
  for (auto carrier = carriers.rbegin(); carrier != carriers.rend(); ++carrier) {
    const int i = *carrier;
    const RigidGroup& group = groups.group(i);
    carried[i] += group.mass;
    moments[i] += group.mass * group.com;
    behind[i] += moments[i].norm();
    if (group.parent < 0) continue;
    carried[group.parent] += carried[i];
    moments[group.parent] += carried[i] * group.anchor;
    behind[group.parent] += behind[i];
  }
}

template <class T>
void set_bounds(const Model& model, const RigidGroups& groups, const Levers& levers, const Schedule& schedule,
                std::vector<BoundConstants<T>>& bounds) {
  bounds.assign(schedule.size(), BoundConstants<T>{});
  for (int slot = 0; slot < schedule.size(); ++slot) {
    for (int k = 0; k < schedule.lanes(); ++k) {
      const Task& task = schedule.tasks(slot)[k];
      if (!task.idle) set_body(model, groups, task.body, levers, k, bounds[slot]);
    }
  }
}
template void set_bounds(const Model&, const RigidGroups&, const Levers&, const Schedule&,
                         std::vector<BoundConstants<double>>&);
template void set_bounds(const Model&, const RigidGroups&, const Levers&, const Schedule&,
                         std::vector<BoundConstants<math::Lanes4>>&);

}  // namespace layfigure::dynamics
