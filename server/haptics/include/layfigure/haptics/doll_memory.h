#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "layfigure/dynamics/model.h"
#include "layfigure/haptics/pins.h"
#include "layfigure/haptics/softness.h"

namespace layfigure::haptics {

/// What is kept of one body and of the joint behind it.
struct JointMemory {
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};       ///< R_PB; a root: R_WB
  Eigen::Quaterniond rest_rotation{Eigen::Quaterniond::Identity()};  ///< where plastic flow has moved it
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};                 ///< a root's origin in the world [m]
  double flow{0.0};                                                  ///< accumulated [rad]
  Eigen::Vector3d torque{Eigen::Vector3d::Zero()};                   ///< of the strain, in B [N m]
  Eigen::Vector3d locked_strain{Eigen::Vector3d::Zero()};            ///< see Hands::lock()
  std::optional<dynamics::JointLaw> law{};        ///< where it is not the one that the doll was made with
  std::optional<dynamics::JointLimits> limits{};  ///< likewise
};

/// A doll at rest as an editor of poses keeps it: pose, plastic flow, pins, and what was set of its parameters. Not:
/// velocities, tools, the pointers' maps. About 300 bytes for each body.
struct DollMemory {
  std::vector<JointMemory> joints;                   ///< one per body
  Eigen::Vector3d gravity{Eigen::Vector3d::Zero()};  ///< [m/s^2]
  std::vector<Pin> pins;
  SoftnessFactors softness;
};

}  // namespace layfigure::haptics
