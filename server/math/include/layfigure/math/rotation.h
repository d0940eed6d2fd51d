#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace layfigure::math {

/// The rotation of |v| radians about v (exponential map).
[[nodiscard]] Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& v);

/// The rotation vector of a unit quaternion, its length in [0, pi] (logarithmic map); q and -q give the same.
[[nodiscard]] Eigen::Vector3d log_rotation(const Eigen::Quaterniond& q);

}  // namespace layfigure::math
