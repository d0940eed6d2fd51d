#include "layfigure/doll/doll.h"

namespace layfigure::doll {
namespace {

using Eigen::Quaterniond;

Quaterniond carried_rotation(const Carrier& carrier) { return Quaterniond(carrier.pose.linear()); }

/// Rotation of a bone beside its parent bone, given that of its carrier's body beside the parent's: R_PB of the
/// dynamics.
Quaterniond bone_rotation(const Doll& doll, int bone, const Quaterniond& R_PB) {
  const int parent = doll.rig.bones[bone].parent;
  const Quaterniond R_BA = carried_rotation(doll.carriers[bone]);
  if (parent < 0) return R_PB * R_BA;  // a root body's R_PB is its R_WB
  return carried_rotation(doll.carriers[parent]).conjugate() * R_PB * R_BA;
}

/// Whether the joint between the bone and its parent bone (a root: the world) moves.
bool moves(const Doll& doll, int bone) {
  const int parent = doll.rig.bones[bone].parent;
  const int body = doll.carriers[bone].body;
  return body >= 0 && (parent < 0 || doll.carriers[parent].body != body);
}

void place_root(const Doll& doll, const dynamics::State& state, SkeletonPose& pose) {
  const Carrier& carrier = doll.carriers.front();
  pose.root_translation = carrier.pose.translation();
  if (carrier.body < 0) return;
  const dynamics::BodyState& body = state.bodies[carrier.body];
  pose.root_translation = body.position + body.rotation * carrier.pose.translation();
}

}  // namespace

void skeleton_pose(const Doll& doll, const dynamics::State& state, SkeletonPose& pose) {
  const std::size_t count = doll.rig.bones.size();
  pose.rotations.resize(count);
  pose.rest_rotations.resize(count);
  pose.torques.assign(count, Eigen::Vector3d::Zero());
  pose.yielding.assign(count, false);
  place_root(doll, state, pose);
  for (int bone = 0; bone < static_cast<int>(count); ++bone) {
    pose.rotations[bone] = pose.rest_rotations[bone] = Quaterniond(doll.rig.bones[bone].rest.linear());
    if (!moves(doll, bone)) continue;
    const dynamics::BodyState& body = state.bodies[doll.carriers[bone].body];
    pose.rotations[bone] = bone_rotation(doll, bone, body.rotation).normalized();
    pose.rest_rotations[bone] = bone_rotation(doll, bone, body.rest_rotation).normalized();
    if (doll.body_of_bone[bone] < 0) continue;
    pose.torques[bone] = body.torque;
    pose.yielding[bone] = body.yielding;
  }
}

}  // namespace layfigure::doll
