#include "layfigure/app/pointer.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "layfigure/math/rotation.h"

namespace layfigure::app {

void Pointer::receive(const PointerPose& pose, std::string client_id, std::int64_t sequence, std::int64_t step,
                      double longest_interval) {
  const double interval = std::clamp(static_cast<double>(step - received_at_step_), 1.0, longest_interval);
  message_interval_ = sequence_ == 0 ? interval : 0.5 * (message_interval_ + interval);
  newest_ = pose;
  client_id_ = std::move(client_id);
  sequence_ = sequence;
  received_at_step_ = step;
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

void Pointer::attach(Grip grip, const PointerPose& held) {
  if (sequence_ == 0) {
    pose_.position = held.position;
    newest_ = pose_;
  }
  grip.position_offset = held.position - pose_.position;
  grip.rotation_offset = pose_.rotation.conjugate() * held.rotation;
  grip_ = std::move(grip);
  glide_done_ = glide_steps_;
}

void Pointer::detach() {
  grip_.reset();
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

}  // namespace layfigure::app
