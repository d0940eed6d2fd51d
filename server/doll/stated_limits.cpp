#include "stated_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "angles.h"
#include "range_of_motion.h"

namespace layfigure::doll {
namespace {

using dynamics::JointLimits;
using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Inside the bounds: 0 if it is, else the middle, of one bound alone that.
double neutral_angle(double lower, double upper) {
  if (lower <= 0.0 && upper >= 0.0) return 0.0;
  if (std::isinf(lower)) return upper;
  return std::isinf(upper) ? lower : 0.5 * (lower + upper);
}

/// How far it is to a bound.
double room(double distance) {
  return distance < std::numbers::pi ? std::max(distance, to_radians(kLeastRangeDeg)) : JointLimits::kInfinity;
}

}  // namespace

JointLimits stated_limits(const BodyPlace& body, const Vector3d& limb) {
  const character::BoneLimits& stated = *body.stated;
  const Matrix3d R_BJ = stated.axes.toRotationMatrix();
  int x = 0;
  (R_BJ.transpose() * (body.bind.conjugate() * limb)).cwiseAbs().maxCoeff(&x);
  const int y = (x + 1) % 3;
  const int z = (x + 2) % 3;

  Vector3d neutral;
  for (int k = 0; k < 3; ++k) neutral[k] = neutral_angle(stated.lower[k], stated.upper[k]);
  const Quaterniond turn = AngleAxisd(neutral.z(), Vector3d::UnitZ()) * AngleAxisd(neutral.y(), Vector3d::UnitY()) *
                           AngleAxisd(neutral.x(), Vector3d::UnitX());
  Matrix3d R_BL;
  R_BL << R_BJ.col(x), R_BJ.col(y), R_BJ.col(z);
  const Vector3d below = neutral - stated.lower;
  const Vector3d above = stated.upper - neutral;

  JointLimits limits;
  limits.axes = Quaterniond(R_BL).normalized();
  limits.reference = (stated.reference * stated.axes * turn * stated.axes.conjugate()).normalized();
  limits.twist_lower = -room(below[x]);
  limits.twist_upper = room(above[x]);
  limits.swing_lower = {room(below[y]), room(below[z])};
  limits.swing_upper = {room(above[y]), room(above[z])};
  return limits;
}

}  // namespace layfigure::doll
