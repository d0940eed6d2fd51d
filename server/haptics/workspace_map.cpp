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
  if (clutched_ && !held) {
    offset_ = world_.position - scaled(hand_.position);
    turn_ = (base_ * hand_.rotation).conjugate() * world_.rotation;
  }
  clutched_ = held;
}

void WorkspaceMap::set_base(const PointerPose& base) {
  base_ = base.rotation;
  offset_ = base.position;
  turn_ = Eigen::Quaterniond::Identity();
  clutched_ = false;
  receive(hand_);
}

dynamics::BodyForce WorkspaceMap::to_hand(const dynamics::BodyForce& on_pointer) const {
  if (clutched_) return {};
  const Eigen::Quaterniond R_DW = base_.conjugate();
  return {.force = scale_ * (R_DW * on_pointer.force), .torque = R_DW * on_pointer.torque};
}

}  // namespace layfigure::haptics
