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

/// Whether the step has riders whose joints would not have stayed still.
bool must_wake(const Model& model, const State& state, Workspace::Data& data, const StepOptions& options, int order) {
  for (const int carrier : data.groups.carriers()) {
    const RigidGroup& group = data.groups.group(carrier);
    if (group.riders == 0) continue;
    data.sleepers.observe(model, group, carrier, state.bodies[carrier], data.runs[order - 1][carrier], options.step,
                          data.orientation_of(carrier));
  }
  return data.sleepers.wake_overloaded(model, state, options.sleep_angle, data.groups);
}

void end_rest_of_woken(const std::vector<char>& asleep, State& state) {
  for (std::size_t i = 0; i < asleep.size(); ++i) {
    if (state.bodies[i].asleep && asleep[i] == 0) state.bodies[i].rest_time = 0.0;
  }
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
  data.prepare(model, state, order);
  std::span<const BodyForce> loads;
  if (may_sleep) {
    loads = loads_of(inputs, state.time + options.step, data.loads);
    if (keeps_resting(inputs, loads, state)) {
      state.time += options.step;
      StepReport unchanged;
      unchanged.asleep = model.size();
      unchanged.resting = true;
      return unchanged;
    }
    if (data.sleepers.wake_touched(model, state, inputs, loads)) regroup();
  } else if (!data.groups.riders().empty() && data.sleepers.wake_all(state)) {
    regroup();
  }
  const Interval whole{.offset = 0.0, .length = options.step};
  StepReport report;
  do {
    report = make_step(model, state, data, data.group_inputs.map(inputs, data.groups), whole, order);
    if (report.status != StepStatus::kOk) return report;
  } while (may_sleep && must_wake(model, state, data, options, order) && (regroup(), true));
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
