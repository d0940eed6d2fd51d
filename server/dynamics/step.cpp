#include "layfigure/dynamics/step.h"

#include <algorithm>

#include "ledger.h"
#include "resting.h"

namespace layfigure::dynamics {
namespace {

/// The loads of the step's end on all bodies, none if there are no loads.
std::span<const BodyForce> loads_of(const Inputs& inputs, double time, std::vector<BodyForce>& loads) {
  if (inputs.loads == nullptr) return {};
  std::fill(loads.begin(), loads.end(), BodyForce{});
  inputs.loads->add(time, loads);
  return loads;
}

/// Whether the step has riders whose joints would not have stayed still. `acting`: the inputs on the groups.
bool must_wake(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
               const Inputs& acting, const StepOptions& options, int order) {
  const RigidGroups& groups = data.groups;
  if (groups.riders().empty()) return false;
  for (const int carrier : groups.carriers()) data.orientations[carrier] = data.orientation_of(carrier);
  const Transmission::Step made{
      .before = state.bodies, .after = data.runs[order - 1], .orientations = data.orientations, .h = options.step};
  const Copy& run = data.copies[order - 1];
  const std::span<const BodyForce> loads =
      inputs.loads == nullptr ? std::span<const BodyForce>{} : std::span<const BodyForce>(run.loads);
  data.transmission.measure(
      model, groups, made,
      {.on_bodies = inputs.couplings, .on_groups = acting.couplings, .forces = run.coupling_forces, .loads = loads});
  for (const int carrier : groups.carriers()) {
    if (groups.group(carrier).riders > 0) data.sleepers.observe(model, groups.group(carrier), carrier, made);
  }
  return data.sleepers.wake_overloaded(model, state, options.sleep_angle, groups, data.transmission);
}

void end_rest_of_woken(const std::vector<char>& asleep, State& state) {
  for (std::size_t i = 0; i < asleep.size(); ++i) {
    if (state.bodies[i].asleep && asleep[i] == 0) state.bodies[i].rest_time = 0.0;
  }
}

StepReport rest(const Model& model, State& state, const StepOptions& options) {
  state.time += options.step;
  StepReport report;
  report.asleep = model.size();
  report.resting = true;
  return report;
}

}  // namespace

StepReport step(const Model& model, State& state, Workspace& workspace, const Inputs& inputs,
                const StepOptions& options) {
  Workspace::Data& data = workspace.data();
  const int order = std::clamp(options.order, 1, kMaxOrder);
  const bool may_sleep = options.sleep_angle > 0.0;
  const auto regroup = [&] {
    end_rest_of_woken(data.sleepers.wanted(), state);
    data.regroup(model, state, order, data.sleepers.wanted());
  };
  data.reserve(inputs);
  std::span<const BodyForce> loads;
  if (may_sleep) {
    loads = loads_of(inputs, state.time + options.step, data.loads);
    if (keeps_resting(inputs, loads, state)) return rest(model, state, options);
  } else {
    state.rest = {};  // the inputs of that rest may come back when the doll has gone
  }
  data.prepare(model, state, order);
  if (may_sleep ? data.sleepers.wake_touched(model, state, inputs, loads)
                : !data.groups.riders().empty() && data.sleepers.wake_all(state)) {
    regroup();
  }
  const Interval whole{.offset = 0.0, .length = options.step};
  StepReport report;
  for (bool again = true; again;) {
    const Inputs& acting = data.group_inputs.map(inputs, data.groups);
    report = make_step(model, state, data, acting, whole, order);
    if (report.status != StepStatus::kOk) return report;
    again = may_sleep && must_wake(model, state, data, inputs, acting, options, order);
    if (again) regroup();
  }
  if (report.extrapolated) extrapolate(data, order);
  if (may_sleep) {
    data.sleepers.count_rest(model, state.bodies, options.step, options.sleep_angle, data.groups.carriers(),
                             data.runs[order - 1]);
  }
  take_result(data, order, options.step, state, report);
  if (!may_sleep) return report;
  if (data.sleepers.all_still()) rest_if_undisturbed(inputs, loads, state);
  if (data.sleepers.let_sleep(model, state)) regroup();
  return report;
}

}  // namespace layfigure::dynamics
