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
  couplings_ = held_.pins;
  for (const PointerPort& pointer : held_.pointers) {
    couplings_.push_back({.body = pointer.port.body,
                          .point = pointer.port.point,
                          .orientation = pointer.orientation,
                          .stiffness = pointer.gains.stiffness,
                          .damping = pointer.gains.damping,
                          .angular_stiffness = pointer.gains.angular_stiffness,
                          .angular_damping = pointer.gains.angular_damping});
  }
  felt_.resize(held_.pointers.size());
}

std::span<const PortWrench> FullRig::tick(std::span<const Hand> hands) {
  const std::size_t pins = held_.pins.size();
  for (std::size_t k = 0; k < felt_.size(); ++k) {
    const CouplingTarget target = hands[k](time());
    Coupling& coupling = couplings_[pins + k];
    coupling.target_position = target.position;
    coupling.target_rotation = target.rotation;
    coupling.target_velocity = target.velocity;
    coupling.target_angular_velocity = target.angular_velocity;
  }
  report_ = scene_.step(state_, {.couplings = couplings_}, {.step = h_}).step;
  for (std::size_t k = 0; k < felt_.size(); ++k) {
    const dynamics::BodyForce& force = scene_.coupling_force(static_cast<int>(pins + k));
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
      targets_(held_.pointers.size()),
      felt_(held_.pointers.size()) {
  std::vector<int> own;
  for (const PointerPort& pointer : held_.pointers) {
    if (pointer.touches) own.push_back(pointer.port.body);
  }
  scene_.leave_contacts_out(own);
}

/// The trial step of the interval to come, with the wrenches of the last one.
void MultirateRig::begin_interval() {
  dynamics::State trial = state_;
  loads_.set(scene_.model(), state_, means_);
  const auto report = scene_.step(trial, {.loads = &loads_, .couplings = held_.pins}, {.step = step_}).step;
  if (report.status != dynamics::StepStatus::kOk) ++failed_;
  const haptics::TrialStep made{.before = state_,
                                .workspace = scene_.workspace(),
                                .loads = means_,
                                .contacts = scene_.left_out(),
                                .length = step_};
  if (modeler_.make(made, held_.pointers, h_, model_)) local_.hand_over(model_);
}

void MultirateRig::step_physics() {
  means_ = local_.end_interval();
  loads_.set(scene_.model(), state_, means_);
  const dynamics::Energy before = measures_losses_ ? energy(scene_.model(), state_) : dynamics::Energy{};
  const auto report = scene_.step(state_, {.loads = &loads_, .couplings = held_.pins}, {.step = step_}).step;
  if (report.status != dynamics::StepStatus::kOk) ++failed_;
  if (measures_losses_) {
    const dynamics::Energy after = energy(scene_.model(), state_);
    const dynamics::Work& work = report.work;
    step_loss_ = work.input - work.viscous - work.flow - work.constraints - (after.total() - before.total());
    step_rounding_ = work.rounding + before.rounding + after.rounding;
  }
  for (int k = 0; k < static_cast<int>(held_.pointers.size()); ++k) {
    const PointerPort& pointer = held_.pointers[k];
    if (!pointer.touches) continue;
    const Eigen::Quaterniond rotation = local_.rotation(k) * pointer.orientation.conjugate();
    const Eigen::Vector3d origin = local_.position(k) - rotation * pointer.port.point;
    haptics::put_body(scene_.model(), pointer.port.body, rotation, origin, local_.velocity(k), state_);
  }
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
    held.pointers.push_back({.pointer = k,
                             .port = {.body = kForearms[k], .point = {0.01, kWrist[k], 0.0}},
                             .orientation = Eigen::Quaterniond::Identity(),
                             .gains = gains,
                             .touches = false});
  }
  scene::Scene scene(held.definition);
  held.start = initial_state(scene.model());
  for (int k = 0; k < kSettlingSteps; ++k) (void)scene.step(held.start, {}, {.step = kSettlingStep});
  held.start.time = 0.0;
  return held;
}

HeldScene touched_limb(const std::vector<haptics::CouplingGains>& hands) {
  constexpr double kLength = 0.3;
  constexpr double kRadius = 0.03;
  constexpr double kBall = 0.01;
  constexpr double kGap = 2e-3;
  constexpr double kAlong[] = {0.9, 0.6};  // of the limb, where the hands touch it
  constexpr double kSide[] = {1.0, -1.0};  // from which they do, along z
  HeldScene held;
  dynamics::ModelDefinition& model = held.definition.model;
  model.root = dynamics::RootKind::kFree;
  model.gravity.setZero();
  const auto add = [&model](const char* name, int parent, const Eigen::Vector3d& anchor, double mass, double size) {
    dynamics::BodyDefinition& body = model.bodies.emplace_back();
    body.name = name;
    body.parent = parent;
    body.anchor = anchor;
    body.mass = mass;
    body.inertia = mass * size * size * Eigen::Matrix3d::Identity();
    return static_cast<int>(model.bodies.size()) - 1;
  };
  const int trunk = add("trunk", -1, {0.0, 0.0, 0.0}, 5.0, 0.1);
  const int limb = add("limb", trunk, {0.1, 0.0, 0.0}, 0.8, 0.09);
  model.bodies[limb].com = {0.5 * kLength, 0.0, 0.0};
  model.bodies[limb].joint.stiffness = 30.0;
  model.bodies[limb].joint.damping = 0.6;
  collision::ShapeDefinition shape;
  shape.name = "limb";
  shape.shape = collision::Capsule{.radius = kRadius, .half_length = 0.5 * kLength};
  shape.body = limb;
  shape.X_BS.position = {0.5 * kLength, 0.0, 0.0};
  shape.X_BS.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  shape.friction = 0.5;
  held.definition.shapes.push_back(shape);
  shape.name = "ball";
  shape.shape = collision::Sphere{.radius = kBall};
  shape.X_BS = {};
  for (std::size_t k = 0; k < hands.size(); ++k) {
    const Eigen::Vector3d place(0.1 + kAlong[k] * kLength, 0.0, kSide[k] * (kRadius + kBall + kGap));
    shape.body = add("ball", -1, place, 0.05, kBall);
    held.definition.shapes.push_back(shape);
    held.definition.excluded.emplace_back(trunk, shape.body);
    held.pointers.push_back({.pointer = static_cast<int>(k),
                             .port = {.body = shape.body, .point = Eigen::Vector3d::Zero()},
                             .orientation = Eigen::Quaterniond::Identity(),
                             .gains = hands[k],
                             .touches = true});
  }
  dynamics::Coupling pin{.body = trunk, .stiffness = 1e5, .damping = 300.0};
  pin.angular_stiffness = 1e3;
  pin.angular_damping = 5.0;
  held.pins.push_back(pin);
  held.start = initial_state(dynamics::Model(model));
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
