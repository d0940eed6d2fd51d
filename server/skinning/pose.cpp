#include "layfigure/skinning/pose.h"

#include <cassert>

namespace layfigure::skinning {

void bone_poses(const Skin& skin, const doll::SkeletonPose& pose, std::span<Eigen::Isometry3d> X_WB) {
  const std::span<const character::Bone> bones = skin.bones();
  assert(pose.rotations.size() == bones.size() && X_WB.size() == bones.size());
  for (std::size_t b = 0; b < bones.size(); ++b) {
    Eigen::Isometry3d X_PB = bones[b].rest;
    X_PB.linear() = pose.rotations[b].toRotationMatrix();
    if (b == 0) X_PB.translation() = pose.root_translation;  // parents come first, so the first bone is a root
    X_WB[b] = bones[b].parent < 0 ? X_PB : X_WB[bones[b].parent] * X_PB;
  }
}

}  // namespace layfigure::skinning
