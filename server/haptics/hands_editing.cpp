/// What an editor of poses does to the doll: other parameters, locks, and its memory.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "layfigure/haptics/hands.h"
#include "layfigure/math/rotation.h"

namespace layfigure::haptics {
namespace {

bool same(const dynamics::JointShape& a, const dynamics::JointShape& b) {
  return a.axes.coeffs() == b.axes.coeffs() && a.stiffness == b.stiffness && a.damping == b.damping &&
         a.yield == b.yield && a.locked == b.locked;
}

bool same(const dynamics::JointLaw& a, const dynamics::JointLaw& b) {
  return a.stiffness == b.stiffness && a.damping == b.damping && a.flow_damping == b.flow_damping &&
         a.yield_torque == b.yield_torque && a.hardening == b.hardening && same(a.shape, b.shape);
}

bool same(const dynamics::JointLimits& a, const dynamics::JointLimits& b) {
  return a.axes.coeffs() == b.axes.coeffs() && a.reference.coeffs() == b.reference.coeffs() &&
         a.twist_lower == b.twist_lower && a.twist_upper == b.twist_upper && a.swing_lower == b.swing_lower &&
         a.swing_upper == b.swing_upper;
}

template <class T>
std::optional<T> if_changed(const T& now, const T& made) {
  return same(now, made) ? std::nullopt : std::optional(now);
}

/// The rest rotation from which the joint is strained by `strain` [rad], section axes.
Eigen::Quaterniond rest_of(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& strain,
                           const Eigen::Quaterniond& axes) {
  return (rotation * math::exp_rotation(axes * strain).conjugate()).normalized();
}

}  // namespace

void Hands::adopt(dynamics::ModelDefinition definition) {
  const dynamics::Model judge(definition);  // throws before anything has changed
  doll_.definition = std::move(definition);
  place_fingertips(std::nullopt);
  touch_.joints_changed();
  tools_changed();
}

void Hands::change(const std::vector<std::pair<int, dynamics::BodyDefinition>>& joints,
                   const std::optional<Eigen::Vector3d>& gravity) {
  dynamics::ModelDefinition definition = doll_.definition;
  for (const auto& [body, changed] : joints) {
    definition.bodies.at(body).joint = changed.joint;
    definition.bodies[body].limits = changed.limits;
  }
  definition.gravity = gravity.value_or(definition.gravity);
  adopt(std::move(definition));
}

void Hands::lock(const std::vector<int>& bodies, const std::array<bool, 3>& axes, bool locked) {
  dynamics::ModelDefinition definition = doll_.definition;
  for (const int i : bodies) {
    dynamics::JointShape& shape = definition.bodies.at(i).joint.shape;
    dynamics::BodyState& now = touch_.state().bodies[i];
    Eigen::Vector3d strain = shape.axes.conjugate() * math::log_rotation(now.rest_rotation.conjugate() * now.rotation);
    bool strain_changes = false;
    for (int k = 0; k < 3; ++k) {
      if (!axes[k] || shape.locked[k] == locked) continue;
      shape.locked[k] = locked;
      std::swap(strain[k], locked_strain_[i][k]);
      if (!locked) locked_strain_[i][k] = 0.0;
      strain_changes = true;
    }
    if (!strain_changes) continue;
    dynamics::wake(model(), touch_.state());
    now.rest_rotation = rest_of(now.rotation, strain, shape.axes);
  }
  adopt(std::move(definition));
}

void Hands::load_pose(const PoseRequest& request) {
  for (const auto& [body, target] : request.targets) {
    const dynamics::BodyDefinition& joint = model().body(body);
    const auto& locked = joint.joint.shape.locked;
    if (joint.parent >= 0 && !std::ranges::all_of(locked, [](bool axis) { return axis; })) continue;
    throw std::invalid_argument("bone '" + doll_.rig.bones[bone_of(body)].name + "' has no joint that can turn");
  }
  drives_.load(request, model(), state(), h_);
  for (const auto& [body, target] : request.targets) {
    if (std::isfinite(model().body(body).joint.yield_torque)) softness_.set_loose(body, true);
  }
  tools_changed();
}

void Hands::cancel_pose() {
  if (!drives_.active()) return;
  hand_over_to_springs();
  forget_drives();
  tools_changed();
}

void Hands::forget_drives() {
  for (int i = 0; i < static_cast<int>(made_.bodies.size()); ++i) softness_.set_loose(i, false);
  drives_.clear();
}

/// What the drives exert, the springs of joints that can flow exert from now on: -K q + d = -K q_after, q the strain.
void Hands::hand_over_to_springs() {
  dynamics::wake(model(), touch_.state());
  dynamics::world_poses(model(), state(), poses_);
  int drive = 0;
  for (int i = 0; i < static_cast<int>(made_.bodies.size()); ++i) {
    if (!drives_.drives(i)) continue;
    const Eigen::Vector3d exerted = poses_[i].rotation.conjugate() * drives_.exerted(drive++);
    const dynamics::JointLaw& law = model().body(i).joint;
    if (!std::isfinite(law.yield_torque)) continue;
    dynamics::BodyState& now = touch_.state().bodies[i];
    const Eigen::Quaterniond& axes = law.shape.axes;
    Eigen::Vector3d strain = axes.conjugate() * math::log_rotation(now.rest_rotation.conjugate() * now.rotation);
    const Eigen::Vector3d torque = axes.conjugate() * exerted;
    for (int k = 0; k < 3; ++k) {
      const double stiffness = law.stiffness * law.shape.stiffness[k];
      if (stiffness > 0.0 && !law.shape.locked[k]) strain[k] -= torque[k] / stiffness;
    }
    now.rest_rotation = rest_of(now.rotation, strain, axes);
  }
}

DollMemory Hands::memory() const {
  DollMemory memory;
  memory.joints.reserve(made_.bodies.size());
  for (std::size_t i = 0; i < made_.bodies.size(); ++i) {
    const dynamics::BodyState& now = state().bodies[i];
    const dynamics::BodyDefinition& body = doll_.definition.bodies[i];
    memory.joints.push_back({.rotation = now.rotation,
                             .rest_rotation = now.rest_rotation,
                             .position = body.parent < 0 ? now.position : Eigen::Vector3d::Zero(),
                             .flow = now.flow,
                             .torque = now.torque,
                             .locked_strain = locked_strain_[i],
                             .law = if_changed(body.joint, made_.bodies[i].joint),
                             .limits = if_changed(body.limits, made_.bodies[i].limits)});
  }
  memory.gravity = doll_.definition.gravity;
  memory.pins.assign(pins_.all().begin(), pins_.all().end());
  memory.softness = softness_.factors();
  return memory;
}

void Hands::recall(const DollMemory& memory) {
  const std::size_t count = made_.bodies.size();
  if (memory.joints.size() != count || memory.softness.own.size() != count) {
    throw std::invalid_argument("it is of a doll of " + std::to_string(memory.joints.size()) +
                                " bodies, this one has " + std::to_string(count));
  }
  dynamics::ModelDefinition definition = made_;
  definition.gravity = memory.gravity;
  for (std::size_t i = 0; i < count; ++i) {
    dynamics::BodyDefinition& body = definition.bodies[i];
    body.joint = memory.joints[i].law.value_or(body.joint);
    body.limits = memory.joints[i].limits.value_or(body.limits);
  }
  dynamics::ModelDefinition there = definition;
  for (std::size_t i = 0; i < count; ++i) {
    dynamics::BodyDefinition& body = there.bodies[i];
    body.rotation = memory.joints[i].rotation;
    body.rest_rotation = memory.joints[i].rest_rotation;
    if (body.parent < 0) body.anchor = memory.joints[i].position;
  }
  dynamics::State state = dynamics::initial_state(dynamics::Model(std::move(there)));  // or throws
  for (std::size_t i = 0; i < count; ++i) {
    state.bodies[i].rotation = memory.joints[i].rotation;  // a model makes them unit once more
    state.bodies[i].rest_rotation = memory.joints[i].rest_rotation;
    state.bodies[i].flow = memory.joints[i].flow;
    state.bodies[i].torque = memory.joints[i].torque;
    locked_strain_[i] = memory.joints[i].locked_strain;
  }
  doll_.definition = std::move(definition);
  put_tools_away();
  forget_drives();
  touch_.put_back(std::move(state));
  softness_.forget_state();
  softness_.restore(memory.softness);
  pins_.restore(memory.pins);
  tools_changed();
}

std::vector<int> Hands::busy_pointers() const {
  std::vector<int> busy;
  for (const auto& [id, pointer] : pointers_) {
    if (pointer.tool() != Tool::kNone) busy.push_back(id);
  }
  return busy;
}

}  // namespace layfigure::haptics
