#include "workspace.h"

#include <algorithm>
#include <cmath>

namespace layfigure::dynamics {
namespace {

// A single run works on several groups at once where that fills at least half of the lanes; a chain does not.
constexpr double kWorthwhileFill = 0.5;
// What a group costs then, in slots of packs: measured on chains.
constexpr double kNarrowSlot = 1.25;

}  // namespace

Workspace::Data::Data(const Model& model, int threads)
    : groups(model),
      levers(groups),
      narrow(make_plan<double>(model, groups, levers, 1)),
      scratch(threads),
      crew(threads - 1),
      sleepers(model),
      transmission(model.size()),
      orientations(model.size()),
      loads(model.size()) {
  const int n = model.size();
  for (int count = 1; count <= kMaxOrder; ++count)
    plans.push_back(make_plan<math::Lanes4>(model, groups, levers, count));
  for (Scratch& own : scratch) {
    own.narrow.resize(n + 1);
    own.wide.resize(plans.back().schedule.size() + 1);
  }
  const State start = initial_state(model);
  for (int i = 0; i < n; ++i) flows = flows || std::isfinite(model.body(i).joint.yield_torque);
  for (int k = 0; k < kMaxOrder; ++k) {
    runs[k] = start.bodies;
    copies[k].loads.resize(n);
    constraints[k].reserve(n);
    copies[k].constraints = &constraints[k];
    arrange(model, k + 1);
  }
}

void Workspace::Data::prepare(const Model& model, State& state, int order) {
  if (!groups.describes(state)) {
    groups.assign(model, state);
    levers.measure(groups);
  }
  for (int count = 1; count <= order; ++count) {
    if (arranged_[count - 1] != groups.version()) arrange(model, count);
  }
}

void Workspace::Data::regroup(const Model& model, State& state, int order, const std::vector<char>& asleep) {
  groups.regroup(model, state, asleep);
  levers.measure(groups);
  prepare(model, state, order);
}

void Workspace::Data::arrange(const Model& model, int count) {
  Plan<math::Lanes4>& plan = plans[count - 1];
  dynamics::arrange(model, groups, levers, plan);
  arranged_[count - 1] = groups.version();
  if (count == 1) choose_width(model);
  std::array<double, kMaxOrder> costs;
  for (int k = 0; k < count; ++k) costs[k] = plans[k].schedule.size();
  if (goes_narrow) costs[0] = kNarrowSlot * narrow.schedule.size();
  shares[count - 1] = share_runs({costs.data(), static_cast<std::size_t>(count)},
                                 static_cast<int>(groups.carriers().size()), static_cast<int>(scratch.size()));
}

void Workspace::Data::choose_width(const Model& model) {
  const Schedule& schedule = plans[0].schedule;
  const double places = schedule.size() * schedule.lanes();
  goes_narrow = places * kWorthwhileFill > static_cast<double>(groups.carriers().size());
  if (goes_narrow) {
    dynamics::arrange(model, groups, levers, narrow);
    set_records(model, groups, narrow.schedule, narrow_records);
  } else {
    set_records(model, groups, schedule, records);
  }
}

void Workspace::Data::reserve(const Inputs& inputs) {
  const std::array sizes{inputs.couplings.size(), inputs.contacts.size(), inputs.ties.size(), inputs.drives.size()};
  if (sizes == reserved_) return;
  transmission.reserve(inputs.couplings.size());
  reserved_ = sizes;
  group_inputs.reserve(inputs);
  for (ConstraintSet& set : constraints) set.reserve_forces(inputs);
  for (Copy& copy : copies) {
    copy.couplings.resize(inputs.couplings.size());
    copy.coupling_forces.resize(inputs.couplings.size());
    copy.drives.resize(inputs.drives.size());
    copy.drive_torques.resize(inputs.drives.size());
  }
}

Eigen::Quaterniond Workspace::Data::orientation_of(int carrier) const {
  const auto of = [carrier](const Schedule& schedule, const auto& all) {
    return math::lane(all[schedule.slot_of(0, carrier)].orientation, schedule.lane_of(0, carrier));
  };
  return goes_narrow ? of(narrow.schedule, scratch[0].narrow) : of(plans[0].schedule, scratch[0].wide);
}

SolveReport Workspace::Data::base_step(const StepContext& context, Scratch& own) const {
  const std::size_t count = context.copies.size();
  if (count == 1 && goes_narrow) return dynamics::base_step(context, narrow, own.narrow);
  return dynamics::base_step(context, plans[count - 1], own.wide);
}

SolveReport Workspace::Data::base_step(const StepContext& context) {
  factored_version = groups.version();
  return base_step(context, scratch[0]);
}

double Workspace::Data::largest_turn() const {
  return goes_narrow ? dynamics::largest_turn(narrow, scratch[0].narrow)
                     : dynamics::largest_turn(plans[0], scratch[0].wide);
}

SolveReport Workspace::Data::shorten(const StepContext& context, double part) {
  if (goes_narrow) return dynamics::shorten(context, narrow, scratch[0].narrow, part);
  return dynamics::shorten(context, plans[0], scratch[0].wide, part);
}

Balance Workspace::Data::measure_balance(const StepContext& context) {
  if (goes_narrow) return dynamics::measure_balance(context, narrow, scratch[0].narrow, narrow_records);
  return dynamics::measure_balance(context, plans[0], scratch[0].wide, records);
}

Workspace::Data::Turning Workspace::Data::turning_of(int carrier) const {
  const auto of = [carrier](const Schedule& schedule, const auto& moved) -> Turning {
    const auto& entry = moved[schedule.slot_of(0, carrier)];
    const int lane = schedule.lane_of(0, carrier);
    return {.spin = math::lane(entry.spin, lane), .added = math::lane(entry.turning, lane)};
  };
  return goes_narrow ? of(narrow.schedule, narrow_records.moved) : of(plans[0].schedule, records.moved);
}

Workspace::Workspace(const Model& model, int threads)
    : data_(std::make_unique<Data>(model, std::clamp(threads, 1, kMaxOrder))) {}
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
