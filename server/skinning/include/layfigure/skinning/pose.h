#pragma once

#include <Eigen/Geometry>
#include <span>

#include "layfigure/doll/doll.h"
#include "layfigure/skinning/skin.h"

namespace layfigure::skinning {

/// X_WB of every bone in a pose of the skeleton, X_WB = X_WP X_PB. The bones keep their lengths: of the translations
/// the pose holds that of the first root; others are the bones' rest ones. `X_WB` has one entry per bone, as have the
/// pose's rotations, which are unit. O(bones), allocates nothing.
void bone_poses(const Skin& skin, const doll::SkeletonPose& pose, std::span<Eigen::Isometry3d> X_WB);

}  // namespace layfigure::skinning
