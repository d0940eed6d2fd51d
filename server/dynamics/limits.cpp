#include "layfigure/dynamics/limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace layfigure::dynamics {
namespace {

constexpr double kPi = std::numbers::pi;
// Up to this swing a turn by an angle changes the twist by at most twice it, |x0 + x1| / (1 + x0 . x1) = 1 / cos(s /
// 2), and the swing vector by at most s / sin(s) < 2.5 times it: what the slack allows for.
constexpr double kSlackSwing = 2.0 * kPi / 3.0;
constexpr double kTwistSlack = 0.5;
constexpr double kSwingSlack = 0.4;
// Below this, sines and angles agree to rounding.
constexpr double kSmallAngle = 1e-8;

struct SwingTwist {
  double twist;
  double angle;               ///< |s|
  Eigen::Vector3d axis;       ///< e of the swing, in the reference's y-z plane
  Eigen::Vector3d direction;  ///< x1, the twist axis after the swing
};

SwingTwist split(const Eigen::Quaterniond& q) {
  const double norm = std::hypot(q.w(), q.x());
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  SwingTwist parts;
  parts.twist = norm > 0.0 ? 2.0 * std::atan2(sign * q.x(), sign * q.w()) : 0.0;
  const double c = norm > 0.0 ? q.w() / norm : 1.0;
  const double s = norm > 0.0 ? q.x() / norm : 0.0;
  // q_swing = q q_twist^-1 has no x component.
  const double y = q.y() * c - q.z() * s;
  const double z = q.z() * c + q.y() * s;
  const double sine = std::hypot(y, z);
  parts.angle = 2.0 * std::atan2(sine, norm);
  parts.axis = sine > kSmallAngle ? Eigen::Vector3d(0.0, y / sine, z / sine) : Eigen::Vector3d::UnitY();
  parts.direction = q * Eigen::Vector3d::UnitX();
  return parts;
}

void bound_twist(const JointLimits& limits, const SwingTwist& parts, LimitState& state) {
  const Eigen::Vector3d sum = Eigen::Vector3d::UnitX() + parts.direction;
  const double denominator = 1.0 + parts.direction.x();
  // d phi/dt = w . (x0 + x1) / (1 + x0 . x1): a minimal swing turns about axes normal to x0 + x1 alone.
  const Eigen::Vector3d rate = denominator > kSmallAngle ? Eigen::Vector3d(sum / denominator) : Eigen::Vector3d::Zero();
  state.lower_twist = {.gap = parts.twist - limits.twist_lower, .direction = rate};
  state.upper_twist = {.gap = limits.twist_upper - parts.twist, .direction = -rate};
}

/// The bound of the swing's own quarter.
Eigen::Vector2d semi_axes(const JointLimits& limits, const Eigen::Vector2d& s) {
  return {s.x() < 0.0 ? limits.swing_lower[0] : limits.swing_upper[0],
          s.y() < 0.0 ? limits.swing_lower[1] : limits.swing_upper[1]};
}

void bound_swing(const JointLimits& limits, const SwingTwist& parts, LimitState& state) {
  const Eigen::Vector2d s = state.swing_y_z;
  const Eigen::Array2d l = semi_axes(limits, s);
  const Eigen::Vector2d scaled = s.array() / l;
  const double F = scaled.norm();
  if (!(F > 0.0)) {
    state.swing.gap = l.minCoeff();
    return;
  }
  const Eigen::Vector2d slope = scaled.array() / l / F;
  const Eigen::Vector3d gradient(0.0, slope.x(), slope.y());
  // ds/dt = e (e . w) + (x0 x e) (s / sin s) (x1 x e) . w: along the swing, and its axis turning about x0.
  const Eigen::Vector3d& e = parts.axis;
  const double sine = std::sin(parts.angle);
  const double ratio = std::abs(sine) > kSmallAngle ? parts.angle / sine : 1.0;
  const Eigen::Vector3d across = Eigen::Vector3d::UnitX().cross(e);
  const Eigen::Vector3d rate = e * gradient.dot(e) + parts.direction.cross(e) * (ratio * gradient.dot(across));
  state.swing = {.gap = (1.0 - F) / slope.norm(), .direction = -rate / slope.norm()};
}

double slack_of(const JointLimits& limits, const LimitState& state) {
  const double angle = state.swing_y_z.norm();
  double slack = kSlackSwing - angle;
  if (limits.limits_twist()) {
    slack = std::min(slack, kTwistSlack * std::min(state.lower_twist.gap, state.upper_twist.gap));
  }
  if (limits.limits_swing()) {
    const Eigen::Vector2d& s = state.swing_y_z;
    const Eigen::Array2d l = semi_axes(limits, s);
    const double least =
        std::min({limits.swing_lower[0], limits.swing_lower[1], limits.swing_upper[0], limits.swing_upper[1]});
    slack = std::min(slack, kSwingSlack * (1.0 - (s.array() / l).matrix().norm()) * least);
  }
  return std::max(slack, 0.0);
}

}  // namespace

bool JointLimits::limits_twist() const { return twist_lower > -kPi || twist_upper < kPi; }

bool JointLimits::limits_swing() const {
  return std::min({swing_lower[0], swing_lower[1], swing_upper[0], swing_upper[1]}) <= kPi;
}

LimitState limit_state(const JointLimits& limits, const Eigen::Quaterniond& rotation) {
  LimitState state;
  const SwingTwist parts = split((limits.reference * limits.axes).conjugate() * rotation * limits.axes);
  state.twist = parts.twist;
  state.swing_y_z = parts.angle * parts.axis.tail<2>();
  if (limits.limits_twist()) bound_twist(limits, parts, state);
  if (limits.limits_swing()) bound_swing(limits, parts, state);
  state.slack = slack_of(limits, state);
  return state;
}

}  // namespace layfigure::dynamics
