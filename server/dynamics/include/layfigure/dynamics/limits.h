#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>

namespace layfigure::dynamics {

/// How far a ball joint turns. Its rotation from the reference pose, in the axes L of the limits, is split into a twist
/// about x and then a swing about an axis in the reference's y-z plane:
///     q = q_swing q_twist,   twist phi in (-pi, pi],   swing vector s = (s_y, s_z),  |s| <= pi
/// and both are bounded:
///     phi_lower <= phi <= phi_upper,    (s_y / l_y)^2 + (s_z / l_z)^2 <= 1
/// with l_y, l_z the bound on the side that s is on: four quarter ellipses make an asymmetric cone.
struct JointLimits {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  Eigen::Quaterniond axes{Eigen::Quaterniond::Identity()};       ///< R_BL: x twists, in the child's frame
  Eigen::Quaterniond reference{Eigen::Quaterniond::Identity()};  ///< R_PB at which twist and swing are zero
  double twist_lower{-kInfinity};                                ///< [rad], <= 0; below -pi: none
  double twist_upper{kInfinity};                                 ///< [rad], >= 0; above pi: none
  std::array<double, 2> swing_lower{kInfinity, kInfinity};       ///< towards -y, -z [rad], > 0; above pi: none
  std::array<double, 2> swing_upper{kInfinity, kInfinity};       ///< towards +y, +z [rad], > 0; above pi: none

  [[nodiscard]] bool limits_twist() const;
  [[nodiscard]] bool limits_swing() const;
  [[nodiscard]] bool any() const { return limits_twist() || limits_swing(); }
};

/// Where a joint is in its limits. Gaps [rad] are negative beyond a limit.
struct LimitState {
  /// One bound as a row: d gap/dt = direction . w to first order, w the child's angular velocity relative to the
  /// parent in the axes of the reference.
  struct Bound {
    double gap{JointLimits::kInfinity};
    Eigen::Vector3d direction{Eigen::Vector3d::Zero()};
  };
  Bound lower_twist;
  Bound upper_twist;
  Bound swing;
  double twist{0.0};                                   ///< phi [rad]
  Eigen::Vector2d swing_y_z{Eigen::Vector2d::Zero()};  ///< s [rad]
  double slack{0.0};  ///< the joint can turn by this angle, whichever way, and meets none of its limits [rad]
};

/// Splits `rotation` = R_PB. At a swing of pi the twist is not defined; it is then taken as zero.
[[nodiscard]] LimitState limit_state(const JointLimits& limits, const Eigen::Quaterniond& rotation);

/// R_PR of the reference axes that the directions are in: reference * axes.
[[nodiscard]] inline Eigen::Quaterniond reference_axes(const JointLimits& limits) {
  return limits.reference * limits.axes;
}

}  // namespace layfigure::dynamics
