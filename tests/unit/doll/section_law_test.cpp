#include "section_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

/// 0.08 m wide, 0.04 m deep.
Section flat_section() {
  Section section;
  section.axes = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized());
  section.area = 0.08 * 0.04;
  const double about_y = 0.04 * std::pow(0.08, 3) / 12;
  const double about_z = 0.08 * std::pow(0.04, 3) / 12;
  section.second_moments = {about_y + about_z, about_y, about_z};
  section.outermost = {std::hypot(0.04, 0.02), 0.04, 0.02};
  section.span = 0.25;
  return section;
}

DollSettings stuff() {
  DollSettings settings;
  settings.elastic_modulus = 2e6;
  settings.poisson_ratio = 0.25;
  settings.viscosity = 3e4;
  settings.flow_viscosity = 5e4;
  settings.yield_stress = 7e5;
  settings.hardening = 1e5;
  return settings;
}

void expect_near(const Vector3d& a, const Vector3d& b) { EXPECT_LT((a - b).norm(), 1e-12 * b.norm()) << a.transpose(); }

TEST(AxisLaw, FlatSection_IsThatOfABeamAndOfAShaft) {
  const Section section = flat_section();
  const AxisLaw law = axis_law(section, stuff());
  const Vector3d& I = section.second_moments;
  expect_near(law.stiffness, Vector3d(2e6 / 2.5 * I.x(), 2e6 * I.y(), 2e6 * I.z()) / 0.25);
  expect_near(law.damping, 3e4 / 2e6 * law.stiffness);
  expect_near(law.yield_torque,
              7e5 * Vector3d(I.x() / (std::sqrt(3.0) * std::hypot(0.04, 0.02)), I.y() / 0.04, I.z() / 0.02));
}

/// A round bar yields at a torque 2 / sqrt(3) times that of its bending, and turns more easily by 1 + nu.
TEST(AxisLaw, RoundSection_TwistAgainstBend) {
  Section section = flat_section();
  section.second_moments = {2e-6, 1e-6, 1e-6};
  section.outermost.setConstant(0.03);
  const AxisLaw law = axis_law(section, stuff());
  EXPECT_NEAR(law.yield_torque.x() / law.yield_torque.y(), 2 / std::numbers::sqrt3, 1e-12);
  EXPECT_NEAR(law.stiffness.y() / law.stiffness.x(), 1.25, 1e-12);
}

TEST(JointLawOfAxes, FlatSection_HasTheWeakestAxisAsItsUnit) {
  const Section section = flat_section();
  const AxisLaw law = axis_law(section, stuff());
  const dynamics::JointLaw joint = joint_law(law, section, stuff());
  EXPECT_EQ(joint.shape.yield.minCoeff(), 1.0);
  EXPECT_EQ(joint.shape.stiffness.minCoeff(), 1.0);
  EXPECT_EQ(joint.shape.damping.minCoeff(), 1.0);
  expect_near(joint.stiffness * joint.shape.stiffness, law.stiffness);
  expect_near(joint.damping * joint.shape.damping, law.damping);
  expect_near(joint.yield_torque * joint.shape.yield, law.yield_torque);
  EXPECT_EQ(joint.shape.axes.coeffs(), section.axes.coeffs());
  // It yields first about z.
  EXPECT_EQ(joint.yield_torque, law.yield_torque.z());
  EXPECT_NEAR(joint.flow_damping, 5e4 * section.second_moments.z() / 0.25, 1e-12 * joint.flow_damping);
  EXPECT_NEAR(joint.hardening, 1e5 * section.second_moments.z() / 0.25, 1e-12 * joint.hardening);
}

TEST(JointLawOfAxes, MaterialWithoutStiffnessOrStrength_IsLooseAndEqual) {
  DollSettings settings = stuff();
  settings.elastic_modulus = settings.viscosity = settings.yield_stress = 0.0;
  const Section section = flat_section();
  const dynamics::JointLaw joint = joint_law(axis_law(section, settings), section, settings);
  EXPECT_EQ(joint.stiffness, 0.0);
  EXPECT_EQ(joint.damping, 0.0);
  EXPECT_EQ(joint.yield_torque, 0.0);
  EXPECT_EQ(joint.shape.stiffness, Vector3d::Ones());
  EXPECT_EQ(joint.shape.damping, Vector3d::Ones());
  EXPECT_EQ(joint.shape.yield, Vector3d::Ones());
}

}  // namespace
}  // namespace layfigure::doll
