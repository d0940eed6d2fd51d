#pragma once

#include <algorithm>
#include <cmath>

#include "layfigure/dynamics/model.h"

/// The law of a joint axis by axis of its section.
namespace layfigure::dynamics {

inline Eigen::Vector3d axis_stiffness(const JointLaw& law) {
  Eigen::Vector3d stiffness = (law.stiffness * law.shape.stiffness).cwiseMin(kRigidStiffness);
  for (int k = 0; k < 3; ++k) {
    if (law.shape.locked[k]) stiffness[k] = kRigidStiffness;
    // 0 times infinity: an axis that is loose whatever the stiffness.
    if (law.shape.stiffness[k] == 0.0 && !law.shape.locked[k]) stiffness[k] = 0.0;
  }
  return stiffness;
}

inline Eigen::Vector3d axis_damping(const JointLaw& law) { return law.damping * law.shape.damping; }

/// 1 / e^2: 0 on an axis that never yields, a locked one among them.
inline Eigen::Vector3d axis_inverse_shape(const JointLaw& law) {
  Eigen::Vector3d inverse = law.shape.yield.cwiseAbs2().cwiseInverse();
  for (int k = 0; k < 3; ++k) {
    if (law.shape.locked[k]) inverse[k] = 0.0;
  }
  return inverse;
}

/// No axis ever moves.
inline bool is_welded(const JointLaw& law) {
  const bool yields = std::isfinite(law.yield_torque) && !axis_inverse_shape(law).isZero(0.0);
  return !yields && (axis_stiffness(law).array() == kRigidStiffness).all();
}

inline bool is_isotropic(const JointLaw& law) {
  const JointShape& shape = law.shape;
  const auto same = [](const Eigen::Vector3d& v) { return v[0] == v[1] && v[1] == v[2]; };
  return same(axis_stiffness(law)) && same(shape.damping) && shape.yield == Eigen::Vector3d::Ones() &&
         same(axis_inverse_shape(law)) && shape.axes.coeffs() == Eigen::Quaterniond::Identity().coeffs();
}

// Gains that differ by no more than this between the axes are added to inertias in world axes: it costs two digits of
// the smallest one.
constexpr double kMildRatio = 100.0;

/// The gains h (h K + D) of the axes are so, whatever h.
inline bool is_mild(const JointLaw& law) {
  const auto mild = [](const Eigen::Vector3d& v) { return v.maxCoeff() <= kMildRatio * v.minCoeff(); };
  return mild(axis_stiffness(law)) && mild(axis_damping(law));
}

}  // namespace layfigure::dynamics
