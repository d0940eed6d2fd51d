#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace layfigure::character {

/// How far the file lets a bone turn: its rotation from the reference is taken apart into turns about the axes J, and
/// each angle is bounded.
struct BoneLimits {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  Eigen::Quaterniond axes{Eigen::Quaterniond::Identity()};       ///< R_BJ
  Eigen::Quaterniond reference{Eigen::Quaterniond::Identity()};  ///< R_PB at which all angles are zero
  Eigen::Vector3d lower{Eigen::Vector3d::Constant(-kInfinity)};  ///< about x, y, z of J [rad]; infinite: none
  Eigen::Vector3d upper{Eigen::Vector3d::Constant(kInfinity)};   ///< [rad], >= lower
};

/// A bone of the skeleton, as the file has it, converted to the world's units and axes (metres, Z up, no scale).
struct Bone {
  std::string name;
  int parent{-1};                                         ///< index of an earlier bone, -1 for a root
  Eigen::Isometry3d rest{Eigen::Isometry3d::Identity()};  ///< X_PB where the file poses it; a root's: X_WB
  Eigen::Isometry3d bind{Eigen::Isometry3d::Identity()};  ///< X_WB when the mesh was bound to it
  std::optional<BoneLimits> limits{};                     ///< none: the file says nothing; a root never has some
};

/// Weight of one bone on one vertex.
struct Influence {
  int bone{0};
  double weight{0.0};  ///< in (0, 1]; a vertex's weights sum to 1
};

/// A skinned triangle mesh in its bind pose, world axes, metres; vertices joined.
struct SkinnedMesh {
  std::string name;
  Eigen::Vector3d color{0.8, 0.8, 0.8};  ///< base colour, linear RGB in 0..1
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;          ///< counter-clockwise seen from outside
  std::vector<std::vector<Influence>> influences;  ///< one list per vertex, heaviest first, never empty
};

/// A rigged character as plain data.
struct Rig {
  std::string name;
  std::string source_file;  ///< base name
  std::vector<Bone> bones;  ///< parents before children
  std::vector<SkinnedMesh> meshes;
  std::vector<std::string> warnings;  ///< one line each: what of the file was mended or left out
  std::uint64_t content_hash{0};      ///< of bones and meshes: equal hashes, equal characters
};

}  // namespace layfigure::character
