#include "section_law.h"

#include <numbers>

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

/// g
Vector3d moments_per_length(const Section& section, double poisson_ratio) {
  Vector3d moments = section.second_moments;
  moments.x() /= 2.0 * (1.0 + poisson_ratio);
  return moments / section.span;
}

/// As multiples of the smallest; where that is none, the axes count as equal.
Vector3d ratios(const Vector3d& values) {
  const double least = values.minCoeff();
  return least > 0.0 ? Vector3d(values / least) : Vector3d(Vector3d::Ones());
}

}  // namespace

AxisLaw axis_law(const Section& section, const DollSettings& settings) {
  const Vector3d g = moments_per_length(section, settings.poisson_ratio);
  AxisLaw law;
  law.stiffness = settings.elastic_modulus * g;
  law.damping = settings.viscosity * g;
  law.yield_torque = settings.yield_stress * section.second_moments.cwiseQuotient(section.outermost);
  law.yield_torque.x() /= std::numbers::sqrt3;
  return law;
}

dynamics::JointLaw joint_law(const AxisLaw& law, const Section& section, const DollSettings& settings) {
  int weakest = 0;
  dynamics::JointLaw joint;
  joint.yield_torque = law.yield_torque.minCoeff(&weakest);
  joint.stiffness = law.stiffness.minCoeff();
  joint.damping = law.damping.minCoeff();
  joint.shape.axes = section.axes;
  joint.shape.stiffness = ratios(law.stiffness);
  joint.shape.damping = ratios(law.damping);
  joint.shape.yield = ratios(law.yield_torque);
  const double g = moments_per_length(section, settings.poisson_ratio)[weakest];
  joint.flow_damping = settings.flow_viscosity * g;
  joint.hardening = settings.hardening * g;
  return joint;
}

}  // namespace layfigure::doll
