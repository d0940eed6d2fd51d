#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "bone_names.h"

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
};

/// One per body, parents before children.
using BodyLayout = std::vector<BodyPlace>;

}  // namespace layfigure::doll
