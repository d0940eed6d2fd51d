// The part of Hands that is served at the haptic rate.
#include <algorithm>

#include "layfigure/haptics/hands.h"

namespace layfigure::haptics {

void Hands::StepLoads::add(double time, std::span<dynamics::BodyForce> forces) const {
  if (weights != nullptr) weights->add(time, forces);
  ports.add(time, forces);
}

void Hands::serve(int count) {
  served_ = count;
  modeler_.emplace(model());
  loads_.reserve(kMostPorts);
  ports_.reserve(kMostPointers);
  leave_to_local_dynamics();
}

bool Hands::any_served_tool() const {
  return std::ranges::any_of(
      pointers_, [this](const auto& entry) { return is_served(entry.first) && entry.second.tool() != Tool::kNone; });
}

/// The ticks move its fingertip, and solve its contacts.
bool Hands::is_local(int pointer) const {
  if (!is_served(pointer)) return false;
  const std::optional<Fingertip>& fingertip = pointers_.at(pointer).fingertip();
  return fingertip && !fingertip->bond;
}

void Hands::leave_to_local_dynamics() {
  std::vector<int> bodies;
  for (const auto& [id, pointer] : pointers_) {
    if (is_local(id)) bodies.push_back(pointer.grip()->coupling.body);
  }
  touch_.scene().leave_contacts_out(std::move(bodies));
}

void Hands::take(const HapticReport& report) {
  tools_ = report.tools;
  loads_.assign(report.loads.begin(), report.loads.begin() + report.load_count);
  // Fingertips may have other indices by now, or be away.
  for (PortLoad& load : loads_) {
    if (load.pointer >= 0 && load.port.body >= static_cast<int>(doll_.definition.bodies.size())) {
      load.port.body = touch_.body_of(load.pointer);
    }
  }
  std::erase_if(loads_, [](const PortLoad& load) { return load.port.body < 0; });
}

/// A step from `state` with what was collected, and with what acts from the haptic side.
dynamics::StepReport Hands::make_step(dynamics::State& state) {
  step_loads_.weights = touch_.weights();
  step_loads_.ports.set(model(), state, loads_);
  const bool has_loads = step_loads_.weights != nullptr || !loads_.empty();
  // What hands hold at the haptic rate is felt to its last joint.
  const double sleep_angle = any_served_tool() ? 0.0 : dynamics::kSleepAngle;
  return touch_.scene()
      .step(state,
            {.loads = has_loads ? &step_loads_ : nullptr,
             .couplings = couplings_,
             .ties = ties_,
             .drives = drives_.aim(h_)},
            {.step = h_, .order = 1, .sleep_angle = sleep_angle})
      .step;
}

void Hands::collect_ports() {
  ports_.clear();
  for (const auto& [id, pointer] : pointers_) {
    if (!is_served(id) || !pointer.grip()) continue;
    const dynamics::Coupling& coupling = pointer.grip()->coupling;
    ports_.push_back({.pointer = id,
                      .port = {.body = coupling.body, .point = coupling.point},
                      .orientation = coupling.orientation,
                      .gains = {.stiffness = coupling.stiffness,
                                .damping = coupling.damping,
                                .angular_stiffness = coupling.angular_stiffness,
                                .angular_damping = coupling.angular_damping},
                      .touches = is_local(id)});
  }
}

/// What acted at a port that is none any more acts no longer.
void Hands::keep_known_loads() {
  const bool touches = std::ranges::any_of(ports_, &PointerPort::touches);
  std::erase_if(loads_, [&](const PortLoad& load) {
    if (load.pointer < 0) return !touches;
    return std::ranges::none_of(ports_, [&](const PointerPort& port) {
      return port.pointer == load.pointer && !port.touches && port.port.body == load.port.body &&
             port.port.point == load.port.point;
    });
  });
}

bool Hands::make_local_model(double tick, LocalModel& model) {
  model.pointers = model.ports = model.contacts = 0;
  model.tick = tick;
  model.length = h_;
  collect_ports();
  keep_known_loads();
  if (ports_.empty()) return true;
  collect_inputs();
  trial_ = touch_.state();
  if (make_step(trial_).status != dynamics::StepStatus::kOk) return false;
  scene::Scene& scene = touch_.scene();
  return modeler_->make({.before = touch_.state(),
                         .workspace = scene.workspace(),
                         .loads = loads_,
                         .contacts = scene.left_out(),
                         .length = h_},
                        ports_, tick, model);
}

void Hands::put_local_fingertips() {
  for (const auto& [id, pointer] : pointers_) {
    if (!is_local(id) || !tools_[id].has_port) continue;
    const ServedTool& tool = tools_[id];
    const dynamics::Coupling& coupling = pointer.grip()->coupling;
    const Eigen::Quaterniond rotation = tool.rotation * coupling.orientation.conjugate();
    put_body(model(), coupling.body, rotation, tool.position - rotation * coupling.point, tool.velocity,
             touch_.state());
  }
}

}  // namespace layfigure::haptics
