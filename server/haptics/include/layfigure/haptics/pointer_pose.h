#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace layfigure::haptics {

/// Where a pointer is, or the hand that leads it.
struct PointerPose {
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};            ///< [m]
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< pointer -> world, or hand -> device; unit
};

}  // namespace layfigure::haptics
