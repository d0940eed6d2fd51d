#include "haptic_rig.h"

#include <cmath>
#include <stdexcept>

#include "scene.h"

namespace layfigure::testing {

using dynamics::Coupling;
using haptics::CouplingTarget;
using haptics::PointerPort;
using haptics::PortWrench;

FullRig::FullRig(HeldScene held, double haptic_hz)
    : held_(std::move(held)), scene_(held_.definition), state_(held_.start), h_(1.0 / haptic_hz) {
  for (const PointerPort& pointer : held_.pointers) {
    couplings_.push_back({.body = pointer.port.body,
                          .point = pointer.port.point,
                          .orientation = pointer.orientation,
                          .stiffness = pointer.gains.stiffness,
                          .damping = pointer.gains.damping,
                          .angular_stiffness = pointer.gains.angular_stiffness,
                          .angular_damping = pointer.gains.angular_damping});
  }
  felt_.resize(couplings_.size());
}

std::span<const PortWrench> FullRig::tick(std::span<const Hand> hands) {
  for (std::size_t k = 0; k < couplings_.size(); ++k) {
    const CouplingTarget target = hands[k](time());
    couplings_[k].target_position = target.position;
    couplings_[k].target_rotation = target.rotation;
    couplings_[k].target_velocity = target.velocity;
    couplings_[k].target_angular_velocity = target.angular_velocity;
  }
  report_ = scene_.step(state_, {.couplings = couplings_}, {.step = h_}).step;
  for (std::size_t k = 0; k < couplings_.size(); ++k) {
    const dynamics::BodyForce& force = scene_.coupling_force(static_cast<int>(k));
    felt_[k] = {.force = -force.force, .torque = -force.torque};
  }
  ++ticks_;
  return felt_;
}

MultirateRig::MultirateRig(HeldScene held, double physics_hz, double haptic_hz)
    : held_(std::move(held)),
      scene_(held_.definition),
      state_(held_.start),
      ticks_per_step_(static_cast<int>(std::lround(haptic_hz / physics_hz))),
      h_(1.0 / haptic_hz),
      step_(ticks_per_step_ * h_),
      modeler_(scene_.model()),
      means_(held_.pointers.size()),
      targets_(held_.pointers.size()),
      felt_(held_.pointers.size()) {}

/// The trial step of the interval to come, with the wrenches of the last one.
void MultirateRig::begin_interval() {
  dynamics::State trial = state_;
  for (std::size_t k = 0; k < means_.size(); ++k) held_.pointers[k].applied = means_[k];
  loads_.set(scene_.model(), state_, held_.pointers, means_);
  const auto report = scene_.step(trial, {.loads = &loads_}, {.step = step_}).step;
  if (report.status != dynamics::StepStatus::kOk) ++failed_;
  const haptics::TrialStep made{
      .before = state_, .workspace = scene_.workspace(), .contacts = scene_.step_contacts(), .length = step_};
  if (modeler_.make(made, held_.pointers, h_, model_)) local_.hand_over(model_);
}

void MultirateRig::step_physics() {
  local_.end_interval(means_);
  loads_.set(scene_.model(), state_, held_.pointers, means_);
  const auto report = scene_.step(state_, {.loads = &loads_}, {.step = step_}).step;
  if (report.status != dynamics::StepStatus::kOk) ++failed_;
}

std::span<const PortWrench> MultirateRig::tick(std::span<const Hand> hands) {
  if (ticks_ % ticks_per_step_ == 0) {
    if (ticks_ > 0) step_physics();
    begin_interval();
  }
  for (std::size_t k = 0; k < hands.size(); ++k) targets_[k] = hands[k](time());
  local_.tick(targets_, felt_);
  ++ticks_;
  return felt_;
}

HeldScene held_doll(int hands, const haptics::CouplingGains& gains) {
  constexpr int kForearms[] = {8, 27};
  constexpr double kWrist[] = {0.25, -0.25};
  constexpr double kSettlingStep = 5e-3;
  constexpr int kSettlingSteps = 8000;
  HeldScene held;
  held.definition.model = load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json").definition;
  for (dynamics::BodyDefinition& body : held.definition.model.bodies) body.rest_rotation = body.rotation;
  for (int k = 0; k < hands; ++k) {
    held.pointers.push_back({.port = {.body = kForearms[k], .point = {0.01, kWrist[k], 0.0}},
                             .orientation = Eigen::Quaterniond::Identity(),
                             .gains = gains,
                             .touches = false,
                             .applied = {}});
  }
  scene::Scene scene(held.definition);
  held.start = initial_state(scene.model());
  for (int k = 0; k < kSettlingSteps; ++k) (void)scene.step(held.start, {}, {.step = kSettlingStep});
  held.start.time = 0.0;
  return held;
}

CouplingTarget held_pose(const HeldScene& held, int k) {
  const dynamics::Model model(held.definition.model);
  std::vector<dynamics::BodyPose> poses;
  world_poses(model, held.start, poses);
  const PointerPort& pointer = held.pointers[k];
  const dynamics::BodyPose& pose = poses[pointer.port.body];
  CouplingTarget target;
  target.position = pose.origin + pose.rotation * pointer.port.point;
  target.rotation = pose.rotation * pointer.orientation;
  return target;
}

}  // namespace layfigure::testing
