#include "layfigure/haptics/pointer.h"

#include <cassert>
#include <utility>

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {

void Pointer::receive(const PointerPose& hand) {
  assert(hand.position.allFinite() && hand.rotation.coeffs().allFinite());
  map_.receive(hand);
  newest_ = map_.world();
  has_pose_ = true;
  if (!grip_) pose_ = newest_;
}

void Pointer::glide(std::int64_t steps) {
  assert(steps > 0);
  glide_from_ = pose_;
  glide_shift_ = newest_.position - pose_.position;
  glide_turn_ = math::log_rotation(newest_.rotation * pose_.rotation.conjugate());
  glide_steps_ = steps;
  glide_done_ = 0;
}

void Pointer::set_clutch(bool held) { map_.set_clutch(held); }

void Pointer::set_base(const PointerPose& base) {
  assert(!grip_);
  map_.set_base(base);
  if (has_pose_) pose_ = newest_ = map_.world();
}

void Pointer::attach(Grip grip, const PointerPose& held) {
  if (!has_pose_) {
    pose_.position = held.position;
    newest_ = pose_;
  }
  grip.position_offset = held.position - pose_.position;
  grip.rotation_offset = pose_.rotation.conjugate() * held.rotation;
  grip_ = std::move(grip);
  glide_done_ = glide_steps_;
}

void Pointer::touch(const FingertipDefinition& fingertip, const dynamics::Coupling& coupling) {
  fingertip_ = Fingertip{.definition = fingertip};
  grip_ = Grip{};
  grip_->coupling = coupling;
  glide_done_ = glide_steps_;
}

void Pointer::set_fingertip_body(int body) {
  assert(fingertip_ && grip_);
  grip_->coupling.body = body;
  if (fingertip_->bond) fingertip_->bond->body_a = body;
}

void Pointer::detach() {
  grip_.reset();
  fingertip_.reset();
  pose_ = newest_;
}

const dynamics::Coupling& Pointer::aim(double h) {
  assert(grip_);
  dynamics::Coupling& coupling = grip_->coupling;
  const bool moving = glide_done_ < glide_steps_;
  const double rate = moving ? 1.0 / (static_cast<double>(glide_steps_) * h) : 0.0;
  coupling.target_position = pose_.position + grip_->position_offset;
  coupling.target_rotation = pose_.rotation * grip_->rotation_offset;
  coupling.target_velocity = glide_shift_ * rate;
  coupling.target_angular_velocity = glide_turn_ * rate;
  return coupling;
}

void Pointer::finish_step(const dynamics::BodyForce& force) {
  assert(grip_);
  grip_->force = force;
  if (glide_done_ == glide_steps_) return;
  ++glide_done_;
  if (glide_done_ == glide_steps_) {
    pose_ = newest_;
    return;
  }
  const double fraction = static_cast<double>(glide_done_) / static_cast<double>(glide_steps_);
  pose_.position = glide_from_.position + fraction * glide_shift_;
  pose_.rotation = math::exp_rotation(fraction * glide_turn_) * glide_from_.rotation;
}

dynamics::BodyForce Pointer::force_on_hand() const {
  if (!grip_) return {};
  return map_.to_hand({.force = -grip_->force.force, .torque = -grip_->force.torque});
}

}  // namespace layfigure::haptics
