#include "layfigure/haptics/workspace_map.h"

#include <cassert>

namespace layfigure::haptics {

void WorkspaceMap::receive(const PointerPose& hand) {
  hand_ = hand;
  if (clutched_) return;
  world_ = {.position = offset_ + scaled(hand_.position), .rotation = base_ * hand_.rotation * turn_};
}

void WorkspaceMap::set_scale(double scale) {
  assert(scale >= kMinScale && scale <= kMaxScale);
  const Eigen::Vector3d before = scaled(hand_.position);
  scale_ = scale;
  offset_ += before - scaled(hand_.position);
}

void WorkspaceMap::set_clutch(bool held) {
  if (clutched_ && !held) place(world_);
  clutched_ = held;
}

void WorkspaceMap::set_base(const PointerPose& base) {
  base_ = base.rotation;
  offset_ = base.position;
  turn_ = Eigen::Quaterniond::Identity();
  clutched_ = false;
  receive(hand_);
}

void WorkspaceMap::place(const PointerPose& world) {
  offset_ = world.position - scaled(hand_.position);
  turn_ = (base_ * hand_.rotation).conjugate() * world.rotation;
  clutched_ = false;
  world_ = world;
}

PointerPose WorkspaceMap::to_device(const PointerPose& world) const {
  const Eigen::Quaterniond R_DW = base_.conjugate();
  return {.position = R_DW * (world.position - offset_) / scale_,
          .rotation = R_DW * world.rotation * turn_.conjugate()};
}

dynamics::BodyForce WorkspaceMap::to_hand(const dynamics::BodyForce& on_pointer) const {
  if (clutched_) return {};
  const Eigen::Quaterniond R_DW = base_.conjugate();
  return {.force = power_scale_ * scale_ * (R_DW * on_pointer.force),
          .torque = power_scale_ * (R_DW * on_pointer.torque)};
}

}  // namespace layfigure::haptics
