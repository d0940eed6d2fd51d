#include "creation_bound.h"

#include "axis_law.h"
#include "inertia.h"

namespace layfigure::dynamics {
namespace {

struct Levers {
  std::vector<double> own;
  std::vector<double> behind;  ///< of the body and all behind it
};

Levers levers_of(const Model& model) {
  const int n = model.size();
  std::vector<double> carried(n, 0.0);
  Levers levers{std::vector<double>(n, 0.0), std::vector<double>(n, 0.0)};
  for (int i = n - 1; i >= 0; --i) {
    const BodyDefinition& body = model.body(i);
    carried[i] += body.mass;
    levers.own[i] += body.mass * body.com.norm();
    levers.behind[i] += levers.own[i];
    if (body.parent < 0) continue;
    carried[body.parent] += carried[i];
    levers.own[body.parent] += carried[i] * body.anchor.norm();
    levers.behind[body.parent] += levers.behind[i];
  }
  return levers;
}

template <class T>
void set_body(const Model& model, int index, const Levers& levers, int k, BoundConstants<T>& bound) {
  const BodyDefinition& body = model.body(index);
  const PrincipalInertia inertia = principal_inertia(body);
  const bool ball = body.parent >= 0 || model.root() == RootKind::kBall;
  math::set_lane(bound.inverse_mass, k, 1.0 / body.mass);
  math::set_lane(bound.lever, k, levers.own[index]);
  math::set_lane(bound.levers, k, levers.behind[index]);
  math::set_lane(bound.largest_moment, k, inertia.moments[2]);
  math::set_lane(bound.inverse_smallest, k, 1.0 / inertia.moments[0]);
  math::set_lane(bound.joint_weight, k, body.parent >= 0 ? 0.5 : 0.0);
  math::set_lane(bound.strain_weight, k, ball && !is_isotropic(body.joint) ? 0.25 : 0.0);
}

}  // namespace

template <class T>
std::vector<BoundConstants<T>> make_bound_constants(const Model& model, const Schedule& schedule) {
  const Levers levers = levers_of(model);
  std::vector<BoundConstants<T>> constants(schedule.size());
  for (int slot = 0; slot < schedule.size(); ++slot) {
    for (int k = 0; k < schedule.lanes(); ++k) {
      const Task& task = schedule.tasks(slot)[k];
      if (task.copy >= 0) set_body(model, task.body, levers, k, constants[slot]);
    }
  }
  return constants;
}
template std::vector<BoundConstants<double>> make_bound_constants(const Model&, const Schedule&);
template std::vector<BoundConstants<math::Lanes4>> make_bound_constants(const Model&, const Schedule&);

}  // namespace layfigure::dynamics
