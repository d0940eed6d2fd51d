#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "bone_names.h"
#include "layfigure/character/rig.h"

namespace layfigure::doll {

/// A body as the rules of limits and mirroring see it, in the bind pose.
struct BodyPlace {
  std::string bone;  ///< as the file calls it
  BoneName name;
  int parent{-1};                                           ///< an earlier body, -1: a root
  Eigen::Vector3d joint{Eigen::Vector3d::Zero()};           ///< world [m]
  Eigen::Vector3d com{Eigen::Vector3d::Zero()};             ///< world [m]
  Eigen::Quaterniond bind{Eigen::Quaterniond::Identity()};  ///< R_WB
  Eigen::Quaterniond rest{Eigen::Quaterniond::Identity()};  ///< R_PB of the rest pose; a root's: R_WB
  std::optional<character::BoneLimits> stated{};            ///< by the file, beside the body's parent
};

/// One per body, parents before children.
using BodyLayout = std::vector<BodyPlace>;

/// Whether a limb called `above` goes on in one called `below`: the upper arm in the forearm, one of a finger's bones
/// in the next, the hand in the fingers but not the thumb. Of unknown bones: in any.
[[nodiscard]] bool continues(const BoneName& above, const BoneName& below);

/// The body above, if it is known and its limb goes on in `b`; else -1.
[[nodiscard]] int limb_above(const BodyLayout& layout, int b);

/// The nearest of that part among `b` and what is above it; -1: none.
[[nodiscard]] int nearest_above(const BodyLayout& layout, int b, BonePart part);

/// From the joint to the one that the limb goes on at (of a hand, the middle of the fingers' first), else to the com;
/// unit. The bone's own Y if both are at the joint.
[[nodiscard]] Eigen::Vector3d limb_direction(const BodyLayout& layout, int b);

}  // namespace layfigure::doll
