#include "layfigure/haptics/hands.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

namespace layfigure::haptics {
namespace {

constexpr double kGripFrequency = 2.0 * std::numbers::pi * 3.0;  // [rad/s] of the whole doll on a grip
constexpr double kLimbShare = 0.1;                               // of the doll's mass: what a fingertip pushes
constexpr std::size_t kUsualPointers = 16;

double total_mass(const doll::Doll& doll) {
  double mass = 0.0;
  for (const dynamics::BodyDefinition& body : doll.definition.bodies) mass += body.mass;
  return mass;
}

std::string named(int pointer) { return "pointer " + std::to_string(pointer); }

}  // namespace

Hands::Hands(doll::Doll doll, double step)
    : doll_(std::move(doll)),
      made_(doll_.definition),
      locked_strain_(doll_.definition.bodies.size(), Eigen::Vector3d::Zero()),
      h_(step),
      touch_(doll_),
      total_mass_(total_mass(doll_)),
      softness_(static_cast<int>(doll_.definition.bodies.size())),
      skin_(skinning::Skin(doll_.rig)) {
  pin_roots();
  couplings_.reserve(root_pins_.size() + kUsualPointers);
  ties_.reserve(kUsualPointers);
  initial_ = memory();
}

void Hands::pin_roots() {
  dynamics::world_poses(model(), state(), poses_);
  const doll::RootPin& gains = doll_.root_pin;
  for (int i = 0; i < model().size(); ++i) {
    if (model().body(i).parent >= 0) continue;
    dynamics::Coupling pin;
    pin.body = i;
    pin.point = model().body(i).com;
    pin.stiffness = gains.stiffness;
    pin.damping = gains.damping;
    pin.angular_stiffness = gains.angular_stiffness;
    pin.angular_damping = gains.angular_damping;
    pin.target_position = poses_[i].com;
    pin.target_rotation = poses_[i].rotation;
    root_pins_.push_back(pin);
  }
}

void Hands::glide(std::int64_t steps) {
  for (auto& [id, pointer] : pointers_) pointer.glide(steps);
}

// ---------------------------------------------------------------- tools

Eigen::Vector3d Hands::grab(const GrabRequest& request) {
  Grip grip;
  grip.bone = request.bone;
  grip.coupling = make_coupling(request);
  require_no_tool(request.pointer);
  const PointerPose held = held_pose(grip);
  pointers_[request.pointer].attach(grip, held);
  tools_changed();
  return held.position;
}

double Hands::default_stiffness() const { return total_mass_ * kGripFrequency * kGripFrequency; }

dynamics::Coupling Hands::make_coupling(const GrabRequest& request) const {
  dynamics::Coupling coupling;
  coupling.point = held_point(doll_, request.bone, request.point);
  coupling.body = doll_.carriers[request.bone].body;
  coupling.stiffness = request.stiffness.value_or(default_stiffness());
  coupling.damping = request.damping.value_or(2.0 * std::sqrt(coupling.stiffness * total_mass_));
  if (request.holds_rotation) hold_rotation(coupling, request.angular_stiffness);
  return coupling;
}

void Hands::hold_rotation(dynamics::Coupling& coupling, const std::optional<double>& angular_stiffness) const {
  const dynamics::BodyDefinition& body = model().body(coupling.body);
  const double gyration_squared = body.inertia.trace() / (2.0 * body.mass);
  const double ratio = coupling.stiffness > 0.0 ? coupling.damping / coupling.stiffness : 0.0;
  coupling.angular_stiffness = angular_stiffness.value_or(gyration_squared * coupling.stiffness);
  coupling.angular_damping = angular_stiffness ? *angular_stiffness * ratio : gyration_squared * coupling.damping;
}

void Hands::set_holds_rotation(int id, bool holds, const std::optional<double>& angular_stiffness) {
  require_grab(id);
  Pointer& pointer = pointers_.at(id);
  dynamics::Coupling coupling = pointer.grip()->coupling;
  coupling.angular_stiffness = coupling.angular_damping = 0.0;
  if (holds) hold_rotation(coupling, angular_stiffness);
  pointer.change_rotation_grip(coupling, held_pose(*pointer.grip()).rotation);
}

void Hands::pose_skin() {
  doll::skeleton_pose(doll_, state(), skeleton_);
  skin_.pose(skeleton_);
}

skinning::SkinPoint Hands::skin_near(int pointer, double reach) {
  const auto found = pointers_.find(pointer);
  if (found == pointers_.end() || !found->second.has_pose()) {
    throw std::invalid_argument(named(pointer) + " has no pose yet; send one, or name the bone");
  }
  pose_skin();
  const std::optional<skinning::SkinPoint> nearest = skin_.closest_point(found->second.pose().position);
  if (!nearest) throw std::invalid_argument("the doll has no skin; name the bone");
  if (nearest->distance > reach) {
    throw std::invalid_argument(named(pointer) + " is " + std::to_string(nearest->distance) +
                                " m from the skin, its reach is " + std::to_string(reach) + " m");
  }
  return *nearest;
}

skinning::SkinPoint Hands::skin_along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  pose_skin();
  const std::optional<skinning::SkinPoint> met = skin_.cast_ray(origin, direction);
  if (!met) throw std::invalid_argument("the ray meets no skin");
  return *met;
}

void Hands::touch(const TouchRequest& request) {
  require_no_tool(request.pointer);
  const auto found = pointers_.find(request.pointer);
  if (found == pointers_.end() || !found->second.has_pose()) {
    throw std::invalid_argument(named(request.pointer) + " has no pose yet; send one before it touches");
  }
  const double stiffness = request.stiffness.value_or(default_stiffness());
  const double damping = request.damping.value_or(2.0 * std::sqrt(stiffness * kLimbShare * total_mass_));
  place_fingertips(std::pair(request.pointer, request.fingertip));
  found->second.touch(request.fingertip, fingertip_coupling(stiffness, damping));
  tools_changed();
}

/// The scene's fingertips become those of the pointers, and one that comes.
void Hands::place_fingertips(std::optional<std::pair<int, FingertipDefinition>> coming) {
  std::vector<FingertipInScene> fingertips;
  for (const auto& [id, pointer] : pointers_) {
    if (pointer.fingertip()) {
      fingertips.push_back({.pointer = id, .definition = pointer.fingertip()->definition, .pose = pointer.pose()});
    } else if (coming && coming->first == id) {
      fingertips.push_back({.pointer = id, .definition = coming->second, .pose = pointer.pose()});
    }
  }
  touch_.set_fingertips(doll_, fingertips);
  if (served_ > 0) modeler_.emplace(model());
}

void Hands::release(int id) {
  const auto found = pointers_.find(id);
  if (found == pointers_.end() || found->second.tool() == Tool::kNone) {
    throw std::invalid_argument(named(id) + " holds nothing");
  }
  const bool touched = found->second.tool() == Tool::kTouch;
  found->second.detach();
  if (touched) place_fingertips(std::nullopt);
  tools_changed();
}

bool Hands::any_tool() const {
  return std::ranges::any_of(pointers_, [](const auto& entry) { return entry.second.tool() != Tool::kNone; });
}

void Hands::tools_changed() {
  for (auto& [id, pointer] : pointers_) {
    if (pointer.fingertip()) pointer.set_fingertip_body(touch_.body_of(id));
  }
  let_bonds_through();
  leave_to_local_dynamics();
  softness_.apply(any_tool(), model(), touch_.state());
}

void Hands::set_magnet(int id, bool on) {
  require_fingertip(id);
  Fingertip& fingertip = *pointers_.at(id).fingertip();
  fingertip.definition.magnet = on;
  if (!on) fingertip.bond.reset();
  let_bonds_through();
  leave_to_local_dynamics();
}

void Hands::set_base(int id, const PointerPose& base) {
  require_no_tool(id);
  pointers_[id].set_base(base);
}

void Hands::require_no_tool(int id) const {
  const auto found = pointers_.find(id);
  if (found == pointers_.end() || found->second.tool() == Tool::kNone) return;
  if (found->second.tool() == Tool::kTouch) {
    throw std::invalid_argument(named(id) + " has its fingertip out already; release it first");
  }
  throw std::invalid_argument(named(id) + " holds '" + doll_.rig.bones[found->second.grip()->bone].name +
                              "' already; release it first");
}

void Hands::require_grab(int id) const {
  const auto found = pointers_.find(id);
  if (found == pointers_.end() || found->second.tool() != Tool::kGrab) {
    throw std::invalid_argument(named(id) + " holds no bone; grab first");
  }
}

void Hands::require_fingertip(int id) const {
  const auto found = pointers_.find(id);
  if (found == pointers_.end() || found->second.tool() != Tool::kTouch) {
    throw std::invalid_argument(named(id) + " has no fingertip out; touch first");
  }
}

// ---------------------------------------------------------------- pins and softness

const Pin& Hands::pin(const PinRequest& request) {
  pins_.add(doll_, total_mass_, state(), model(), request);
  return pins_.all().back();
}

void Hands::unpin(int id) {
  if (!pins_.remove(id)) throw std::invalid_argument("there is no pin " + std::to_string(id));
}

void Hands::unpin_all() { pins_.clear(); }

void Hands::set_softness(double factor) {
  softness_.set(factor);
  softness_.apply(any_tool(), model(), touch_.state());
}

void Hands::set_softness(double factor, int bone) {
  require_joint(bone);
  softness_.set(doll_.body_of_bone[bone], factor);
  softness_.apply(any_tool(), model(), touch_.state());
}

void Hands::require_joint(int bone) const {
  const int body = doll_.body_of_bone.at(bone);
  if (body >= 0 && doll_.definition.bodies[body].parent >= 0) return;
  throw std::invalid_argument("bone '" + doll_.rig.bones[bone].name + "' has no joint of its own");
}

void Hands::reset() {
  put_tools_away();
  forget_drives();
  pins_.clear();
  std::ranges::fill(locked_strain_, Eigen::Vector3d::Zero());
  touch_.reset();
  softness_.forget_state();
  let_bonds_through();
  leave_to_local_dynamics();
}

void Hands::put_tools_away() {
  for (auto& [id, pointer] : pointers_) {
    if (pointer.tool() != Tool::kNone) pointer.detach();
  }
  place_fingertips(std::nullopt);
}

// ---------------------------------------------------------------- the step

dynamics::StepReport Hands::step() {
  collect_inputs();
  const dynamics::StepReport report = make_step(touch_.state());
  if (report.status == dynamics::StepStatus::kOk && !report.resting) finish_step();
  return report;
}

void Hands::collect_inputs() {
  couplings_.assign(root_pins_.begin(), root_pins_.end());
  ties_.clear();
  for (const Pin& pin : pins_.all()) {
    if (pin.rigid) {
      ties_.push_back(pin.tie);
    } else {
      couplings_.push_back(pin.coupling);
    }
  }
  first_grip_ = couplings_.size();
  first_bond_ = ties_.size();
  for (auto& [id, pointer] : pointers_) {
    if (pointer.grip() && !is_served(id)) {
      if (pointer.fingertip()) pointer.observe_tip(tip_motion(pointer));
      couplings_.push_back(pointer.aim(h_));
    }
    if (pointer.fingertip() && pointer.fingertip()->bond) ties_.push_back(*pointer.fingertip()->bond);
  }
}

/// A bond holds a fingertip like a grip: the hand tilts what it holds.
TipMotion Hands::tip_motion(const Pointer& pointer) const {
  const int body = pointer.grip()->coupling.body;
  const dynamics::BodyState& tip = state().bodies[body];
  const Eigen::Matrix3d R = tip.rotation.toRotationMatrix();
  const Eigen::Vector3d in_tip = model().body(body).inertia.llt().solve(R.transpose() * tip.angular_momentum);
  const Fingertip& fingertip = *pointer.fingertip();
  return {.rotation = tip.rotation,
          .angular_velocity = R * in_tip,
          .normal = fingertip.bond ? Eigen::Vector3d::Zero() : fingertip.touched.normal};
}

void Hands::finish_step() {
  int index = static_cast<int>(first_grip_);
  for (auto& [id, pointer] : pointers_) {
    if (!pointer.grip()) continue;
    pointer.finish_step(is_served(id) ? tools_[id].force : touch_.scene().coupling_force(index++));
  }
  for (int k = 0; k < drives_.count(); ++k) drives_.observe(k, touch_.scene().drive_torque(k));
  if (drives_.active() && drives_.finish_step(state(), h_)) cancel_pose();
  if (touch_.weights() == nullptr) return;
  put_local_fingertips();
  observe_contacts();
  form_bonds();
}

/// What the fingertips met.
void Hands::observe_contacts() {
  const scene::Scene& scene = touch_.scene();
  int bond = static_cast<int>(first_bond_);
  for (auto& [id, pointer] : pointers_) {
    if (!pointer.fingertip()) continue;
    Fingertip& fingertip = *pointer.fingertip();
    fingertip.touched = {};
    if (is_local(id)) {
      const LocalTouch& local = tools_[id].touched;
      fingertip.touched = {.body = local.body, .force = local.force, .contact = local.contact, .normal = local.normal};
      continue;
    }
    const int body = pointer.grip()->coupling.body;
    double hardest = 0.0;  // of what is the doll's
    double hardest_of_all = 0.0;
    for (std::size_t k = 0; k < scene.contacts().size(); ++k) {
      const collision::ContactPoint& point = scene.contacts()[k];
      if (point.body_a != body && point.body_b != body) continue;
      const Eigen::Vector3d on_a = scene.contact_force(static_cast<int>(k));
      if (on_a.isZero(0.0)) continue;
      fingertip.touched.contact = true;
      fingertip.touched.force += point.body_a == body ? on_a : Eigen::Vector3d(-on_a);
      if (on_a.norm() > hardest_of_all) {
        hardest_of_all = on_a.norm();
        fingertip.touched.normal = point.normal_W;
      }
      const int other = point.body_a == body ? point.body_b : point.body_a;
      if (other == collision::kWorldBody || on_a.norm() <= hardest) continue;
      hardest = on_a.norm();
      fingertip.touched.body = other;
    }
    if (!fingertip.bond) continue;
    fingertip.touched.contact = true;
    fingertip.touched.body = fingertip.bond->body_b;
    fingertip.touched.force += scene.tie_force(bond++).force;
  }
}

/// Magnets that touch a body of the doll stick to it, as they lie on it now.
void Hands::form_bonds() {
  bool formed = false;
  for (auto& [id, pointer] : pointers_) {
    if (!pointer.fingertip()) continue;
    Fingertip& fingertip = *pointer.fingertip();
    if (!fingertip.definition.magnet || fingertip.bond || fingertip.touched.body == dynamics::kWorld) continue;
    dynamics::world_poses(model(), state(), poses_);
    const int body = pointer.grip()->coupling.body;
    const dynamics::BodyPose& tip = poses_[body];
    const dynamics::BodyPose& held = poses_[fingertip.touched.body];
    const Eigen::Quaterniond R_BW = held.rotation.conjugate();
    fingertip.bond = dynamics::Tie{.body_a = body,
                                   .body_b = fingertip.touched.body,
                                   .point_b = R_BW * (tip.origin - held.origin),
                                   .holds_rotation = true,
                                   .rotation = R_BW * tip.rotation};
    formed = true;
  }
  if (!formed) return;
  let_bonds_through();
  leave_to_local_dynamics();
}

/// What a bond holds together does not touch beside that: its rows would contradict the contact's.
void Hands::let_bonds_through() {
  std::vector<std::pair<int, int>> pairs;
  for (const auto& [id, pointer] : pointers_) {
    const std::optional<Fingertip>& fingertip = pointer.fingertip();
    if (fingertip && fingertip->bond) pairs.emplace_back(fingertip->bond->body_a, fingertip->bond->body_b);
  }
  touch_.scene().let_through(pairs);
}

PointerPose Hands::held_pose(const Grip& grip) const {
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(model(), state(), poses);
  const dynamics::BodyPose& body = poses[grip.coupling.body];
  return {body.origin + body.rotation * grip.coupling.point, body.rotation};
}

int Hands::bone_of(int body) const {
  return body >= 0 && body < static_cast<int>(doll_.bone_of_body.size()) ? doll_.bone_of_body[body] : -1;
}

}  // namespace layfigure::haptics
