#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "layfigure/collision/shapes.h"

namespace layfigure::collision {

/// No point within `radius` of its frame's origin has gone further on the way between two poses [m]. Of two unit
/// quaternions of the same sign, R1 - R0 has the norm 2 sin(angle / 2) <= 2 |q1 - q0|.
inline double largest_motion(const Pose& from, const Pose& to, double radius) {
  constexpr double kUnit = 1.0 + 1e-5;  // quaternions are unit to 1e-6 only
  const auto& q0 = from.rotation.coeffs();
  const auto& q1 = to.rotation.coeffs();
  const double turned = 2.0 * kUnit * std::sqrt(std::min((q1 - q0).squaredNorm(), (q1 + q0).squaredNorm()));
  return (to.position - from.position).norm() + (turned > 0.0 ? turned * radius : 0.0);
}

/// Where a body is, and how far it has gone.
struct MovingBody {
  Pose X_WB{};
  Eigen::Matrix3d R_WB{Eigen::Matrix3d::Identity()};
  double reach{0.0};   ///< see World::update() [m]
  double radius{0.0};  ///< of its shapes about its origin, infinite if one is a plane [m]
  double travel{0.0};  ///< no point of its shapes has gone further since the beginning [m]
  bool moved{false};   ///< in the last update; or its reach changed

  /// Puts it where it is at the beginning.
  void start(const Pose& pose, double new_reach) {
    travel = 0.0;
    set(pose, new_reach);
  }

  void move(const Pose& pose, double new_reach) {
    moved = X_WB.position != pose.position || X_WB.rotation.coeffs() != pose.rotation.coeffs() || reach != new_reach;
    if (!moved) return;
    travel += largest_motion(X_WB, pose, radius);
    set(pose, new_reach);
  }

  /// Of another body in this one's frame.
  [[nodiscard]] Pose pose_of(const MovingBody& other) const {
    return {.rotation = X_WB.rotation.conjugate() * other.X_WB.rotation,
            .position = R_WB.transpose() * (other.X_WB.position - X_WB.position)};
  }

 private:
  void set(const Pose& pose, double new_reach) {
    moved = true;
    X_WB = pose;
    reach = new_reach;
    R_WB = pose.rotation.normalized().toRotationMatrix();
  }
};

}  // namespace layfigure::collision
