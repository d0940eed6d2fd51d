#include "workspace.h"

#include <algorithm>
#include <cmath>

#include "axis_law.h"
#include "creation_bound.h"
#include "inertia.h"

namespace layfigure::dynamics {
namespace {

// A single run works on several bodies at once where that fills at least half of the lanes; a chain does not.
constexpr double kWorthwhileFill = 0.5;

template <class T>
void set_body(const BodyDefinition& body, RootKind root, int k, Constants<T>& constants) {
  const auto [moments, axes] = principal_inertia(body);
  const auto dyad = [&](int axis) -> Eigen::Vector3d { return axes.col(axis) * std::sqrt(moments[axis] - moments[0]); };
  const bool free = body.parent < 0 && root == RootKind::kFree;
  const bool fixed = body.parent < 0 && root == RootKind::kFixed;
  math::set_lane(constants.mass, k, body.mass);
  math::set_lane(constants.anchor, k, body.parent < 0 ? Eigen::Vector3d::Zero() : body.anchor);
  math::set_lane(constants.com, k, body.com);
  math::set_lane(constants.inertia, k, moments[0]);
  math::set_lane(constants.u, k, dyad(1));
  math::set_lane(constants.v, k, dyad(2));
  const JointLaw law = free || fixed ? JointLaw{} : body.joint;
  set_lane(constants.section, k, law.shape.axes);
  set_lane(constants.stiffness, k, axis_stiffness(law));
  set_lane(constants.damping, k, axis_damping(law));
  set_lane(constants.inverse_shape, k, axis_inverse_shape(law));
  math::set_lane(constants.flow_damping, k, law.flow_damping);
  math::set_lane(constants.yield, k, law.yield_torque);
  math::set_lane(constants.hardening, k, law.hardening);
  math::set_lane(constants.free, k, free ? 1.0 : 0.0);
  math::set_lane(constants.fixed, k, fixed ? 1.0 : 0.0);
  constants.roots = constants.roots || free || fixed;
  constants.flows = constants.flows || std::isfinite(law.yield_torque);
  math::set_lane(constants.anisotropic, k, is_isotropic(law) ? 0.0 : 1.0);
  constants.isotropic = constants.isotropic && is_isotropic(law);
  constants.limited = constants.limited || (!free && !fixed && body.limits.any());
}

template <class T>
Plan<T> make_plan(const Model& model, int copies) {
  std::vector<int> parents;
  for (int i = 0; i < model.size(); ++i) parents.push_back(model.body(i).parent);
  Plan<T> plan{
      .schedule = Schedule(parents, copies, math::LaneTraits<T>::kCount), .constants = {}, .limited = {}, .bounds = {}};
  // An idle lane computes the motion of a unit ball that nothing reads.
  const BodyDefinition idle;
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    Constants<T>& constants = plan.constants.emplace_back();
    constants.roots = constants.flows = constants.limited = false;
    constants.isotropic = true;
    for (int k = 0; k < plan.schedule.lanes(); ++k) {
      const Task& task = plan.schedule.tasks(slot)[k];
      set_body(task.copy < 0 ? idle : model.body(task.body), task.copy < 0 ? RootKind::kBall : model.root(), k,
               constants);
    }
  }
  for (int i = 0; i < model.size(); ++i) {
    const bool jointed = model.body(i).parent >= 0 || model.root() == RootKind::kBall;
    if (jointed && model.body(i).limits.any()) plan.limited.push_back(i);
  }
  plan.bounds = make_bound_constants<T>(model, plan.schedule);
  return plan;
}

}  // namespace

Workspace::Data::Data(const Model& model) {
  const int n = model.size();
  Plan<math::Lanes4> wide = make_plan<math::Lanes4>(model, 1);
  if (wide.schedule.size() * wide.schedule.lanes() * kWorthwhileFill <= n) {
    records = make_balance_records<math::Lanes4>(model, wide.schedule);
    plans.push_back(std::move(wide));
  } else {
    narrow.emplace(make_plan<double>(model, 1));
    narrow_nodes.resize(n + 1);
    narrow_records = make_balance_records<double>(model, narrow->schedule);
  }
  for (int count = 2; count <= kMaxOrder; ++count) plans.push_back(make_plan<math::Lanes4>(model, count));
  nodes.resize(plans.back().schedule.size() + 1);
  const State start = initial_state(model);
  for (int i = 0; i < n; ++i) flows = flows || std::isfinite(model.body(i).joint.yield_torque);
  for (int k = 0; k < kMaxOrder; ++k) {
    runs[k] = start.bodies;
    copies[k].loads.resize(n);
    constraints[k].reserve(n);
    copies[k].constraints = &constraints[k];
  }
}

void Workspace::Data::reserve(const Inputs& inputs) {
  for (Copy& copy : copies) {
    copy.coupling_forces.resize(inputs.couplings.size());
    copy.drives.resize(inputs.drives.size());
    copy.drive_torques.resize(inputs.drives.size());
  }
}

SolveReport Workspace::Data::base_step(const StepContext& context) {
  const int count = static_cast<int>(context.copies.size());
  if (count == 1 && narrow) return dynamics::base_step(context, *narrow, narrow_nodes);
  return dynamics::base_step(context, plans[count - (narrow ? 2 : 1)], nodes);
}

double Workspace::Data::largest_turn() const {
  return narrow ? dynamics::largest_turn(*narrow, narrow_nodes) : dynamics::largest_turn(plans[0], nodes);
}

SolveReport Workspace::Data::shorten(const StepContext& context, double part, bool constrained) {
  if (narrow) return dynamics::shorten(context, *narrow, narrow_nodes, part, constrained);
  return dynamics::shorten(context, plans[0], nodes, part, constrained);
}

Balance Workspace::Data::measure_balance(const StepContext& context) {
  if (narrow) return dynamics::measure_balance(context, *narrow, narrow_nodes, narrow_records);
  return dynamics::measure_balance(context, plans[0], nodes, records);
}

Workspace::Data::Turning Workspace::Data::turning_of(int body) const {
  const auto of = [body](const Schedule& schedule, const auto& moved) -> Turning {
    const auto& entry = moved[schedule.slot_of(0, body)];
    const int lane = schedule.lane_of(0, body);
    return {.spin = math::lane(entry.spin, lane), .added = math::lane(entry.turning, lane)};
  };
  return narrow ? of(narrow->schedule, narrow_records.moved) : of(plans[0].schedule, records.moved);
}

Workspace::Workspace(const Model& model) : data_(std::make_unique<Data>(model)) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

const BodyForce& Workspace::coupling_force(int index) const {
  return data_->copies[data_->finest].coupling_forces[index];
}

const Eigen::Vector3d& Workspace::drive_torque(int index) const {
  return data_->copies[data_->finest].drive_torques[index];
}

const Eigen::Vector3d& Workspace::contact_force(int index) const {
  return data_->constraints[data_->finest].contact_force(index);
}

const BodyForce& Workspace::tie_force(int index) const { return data_->constraints[data_->finest].tie_force(index); }

}  // namespace layfigure::dynamics
