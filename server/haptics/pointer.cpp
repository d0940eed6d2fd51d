#include "layfigure/haptics/pointer.h"

#include <cassert>
#include <utility>

namespace layfigure::haptics {

void Pointer::receive(const PointerPose& hand) {
  assert(hand.position.allFinite() && hand.rotation.coeffs().allFinite());
  map_.receive(hand);
  newest_ = map_.world();
  has_pose_ = true;
  if (!grip_) pose_ = newest_;
}

void Pointer::glide(std::int64_t steps) { glide_.start(pose_, newest_, steps); }

void Pointer::follow(double h) {
  rate_.follow(pose_, newest_, h);
  pose_ = newest_;
  glide_.stop();
}

void Pointer::set_clutch(bool held) { map_.set_clutch(held); }

void Pointer::set_base(const PointerPose& base) {
  assert(!grip_);
  map_.set_base(base);
  if (has_pose_) pose_ = newest_ = map_.world();
}

void Pointer::place(const PointerPose& world) {
  assert(!grip_);
  map_.place(world);
  pose_ = newest_ = world;
  has_pose_ = true;
}

void Pointer::attach(Grip grip, const PointerPose& held) {
  if (!has_pose_) {
    pose_.position = held.position;
    newest_ = pose_;
  }
  grip.position_offset = held.position - pose_.position;
  grip.rotation_offset = pose_.rotation.conjugate() * held.rotation;
  grip_ = std::move(grip);
  ++tools_taken_;
  glide_.stop();
}

void Pointer::change_rotation_grip(const dynamics::Coupling& gains, const Eigen::Quaterniond& held) {
  assert(grip_ && !fingertip_);
  grip_->coupling.angular_stiffness = gains.angular_stiffness;
  grip_->coupling.angular_damping = gains.angular_damping;
  grip_->rotation_offset = pose_.rotation.conjugate() * held;
}

void Pointer::touch(const FingertipDefinition& fingertip, const dynamics::Coupling& coupling) {
  fingertip_ = Fingertip{.definition = fingertip};
  tip_ = {};
  grip_ = Grip{};
  grip_->coupling = coupling;
  ++tools_taken_;
  glide_.stop();
}

void Pointer::observe_tip(const TipMotion& tip) {
  assert(fingertip_);
  tip_ = tip;
}

void Pointer::set_fingertip_body(int body) {
  assert(fingertip_ && grip_);
  grip_->coupling.body = body;
  if (fingertip_->bond) fingertip_->bond->body_a = body;
}

void Pointer::detach() {
  grip_.reset();
  fingertip_.reset();
  rate_ = {};
  pose_ = newest_;
}

const dynamics::Coupling& Pointer::aim(double h) {
  assert(grip_);
  dynamics::Coupling& coupling = grip_->coupling;
  coupling.target_position = pose_.position + grip_->position_offset;
  coupling.target_rotation = pose_.rotation * grip_->rotation_offset;
  coupling.target_velocity = rate_.linear + glide_.velocity(h);
  coupling.target_angular_velocity = rate_.angular + glide_.angular_velocity(h);
  if (fingertip_) {
    const SoftTip::Target target = fingertip_->soft.follow(coupling.target_rotation, coupling.target_angular_velocity,
                                                           tip_, coupling.angular_stiffness, coupling.angular_damping);
    coupling.target_rotation = target.rotation;
    coupling.target_angular_velocity = target.angular_velocity;
  }
  return coupling;
}

void Pointer::finish_step(const dynamics::BodyForce& force) {
  assert(grip_);
  grip_->force = force;
  if (glide_.moving()) pose_ = glide_.advance();
}

dynamics::BodyForce Pointer::force_on_hand() const {
  if (!grip_) return {};
  const Eigen::Vector3d torque = fingertip_ ? fingertip_->soft.of_hand(grip_->force.torque) : grip_->force.torque;
  return map_.to_hand({.force = -grip_->force.force, .torque = -torque});
}

}  // namespace layfigure::haptics
