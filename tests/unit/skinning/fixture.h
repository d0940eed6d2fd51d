#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "layfigure/character/rig.h"
#include "layfigure/skinning/deform.h"
#include "layfigure/skinning/skin.h"
#include "random_vector.h"

namespace layfigure::skinning::test {

/// A cube with corners at +-1 m that one bone moves.
[[nodiscard]] character::Rig cube_rig();

/// Any rigid motion that is no special case.
[[nodiscard]] Eigen::Isometry3d odd_motion();

using testing::random_vector;

/// Each bone turned by some angle up to `angle` [rad] beside its parent, all of them moved.
[[nodiscard]] std::vector<Eigen::Isometry3d> random_poses(const Skin& skin, double angle, unsigned seed);

/// The bind poses.
[[nodiscard]] std::vector<Eigen::Isometry3d> bind_poses(const Skin& skin);

struct Deformed {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> normals;
};

[[nodiscard]] Deformed deformed(const Skin& skin, const std::vector<Eigen::Isometry3d>& X_WB, Blend blend);

}  // namespace layfigure::skinning::test
