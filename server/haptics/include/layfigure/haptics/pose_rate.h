#pragma once

#include <Eigen/Core>

#include "layfigure/haptics/pointer_pose.h"

namespace layfigure::haptics {

/// Time constant of a device's velocity [s]: the damping of a coupling then makes no more of the encoders' rounding
/// than its stiffness does, and a hand, which moves at less than 10 Hz, does not feel the lag.
inline constexpr double kVelocitySmoothing = 0.01;

/// How fast a pose moves that is told at intervals. A single interval's velocity is no good: the encoders' rounding
/// makes q / h of a length q. So it is smoothed over kVelocitySmoothing.
struct PoseRate {
  Eigen::Vector3d linear{Eigen::Vector3d::Zero()};   ///< world [m/s]
  Eigen::Vector3d angular{Eigen::Vector3d::Zero()};  ///< world [rad/s]

  /// From one pose to the next within `h` [s], > 0.
  void follow(const PointerPose& from, const PointerPose& to, double h);
};

}  // namespace layfigure::haptics
