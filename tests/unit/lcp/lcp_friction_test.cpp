#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "lcp_checks.h"

namespace layfigure::testing {
namespace {

using dynamics::LcpRow;
using dynamics::LcpStatus;

std::vector<LcpRow> contacts(int count, double mu) {
  std::vector<LcpRow> rows;
  for (int i = 0; i < count; ++i) add_contact(mu, rows);
  return rows;
}

/// A point mass on a plane, pressed with speed `press` and pushed along the plane.
LcpSet point_on_plane(double mass, double press, const Eigen::Vector2d& push, double mu) {
  return {Eigen::Matrix3d::Identity() / mass, Eigen::Vector3d(-press, push.x(), push.y()), contacts(1, mu)};
}

/// A cube of edge 2 and mass 1 on its four corners: Jacobian rows n, t1, t2 per corner, over [angular; linear].
Eigen::MatrixXd cube_jacobian() {
  Eigen::MatrixXd jacobian(12, 6);
  const Eigen::Matrix3d axes{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
  int row = 0;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d axis = axes.row(k);
        jacobian.row(row++) << Eigen::Vector3d(x, y, -1.0).cross(axis).transpose(), axis.transpose();
      }
    }
  }
  return jacobian;
}

/// The cube with the free velocity `twist` [angular; linear] on its contacts.
LcpSet cube_on_floor(const Eigen::VectorXd& twist, double mu) {
  const Eigen::MatrixXd jacobian = cube_jacobian();
  Eigen::VectorXd inverse_mass(6);
  inverse_mass << 1.5, 1.5, 1.5, 1.0, 1.0, 1.0;
  return {jacobian * inverse_mass.asDiagonal() * jacobian.transpose(), jacobian * twist, contacts(4, mu)};
}

Eigen::VectorXd falling_cube(double vx, double vy, double vz) {
  Eigen::VectorXd twist = Eigen::VectorXd::Zero(6);
  twist.tail<3>() << vx, vy, vz;
  return twist;
}

TEST(LcpFriction, PointPushedInsideTheCone_Sticks) {
  const LcpSet set = point_on_plane(2.0, 1.0, {0.2, -0.3}, 0.5);
  const LcpAnswer answer = solve(set);
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_LE(answer.velocities.norm(), 1e-10);
  EXPECT_NEAR(answer.impulses[0], 2.0, 1e-10);
}

TEST(LcpFriction, PointPushedOutOfTheCone_SlidesAtTheConesAngleInEveryDirection) {
  // In closed form: lambda_n = m press, slip = (|push| - mu press) along the push. A pyramid would fail here.
  const double mu = 0.4;
  for (int k = 0; k < 36; ++k) {
    const double angle = k * std::numbers::pi / 18.0;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const LcpAnswer answer = solve(point_on_plane(3.0, 2.0, 1.5 * direction, mu));
    EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
    EXPECT_NEAR(answer.impulses[0], 6.0, 1e-9);
    EXPECT_LE((answer.impulses.tail<2>() + mu * 6.0 * direction).norm(), 1e-9);
    EXPECT_LE((answer.velocities.tail<2>() - (1.5 - mu * 2.0) * direction).norm(), 1e-9);
    EXPECT_NEAR(answer.velocities[0], 0.0, 1e-9);  // the exact law does not dilate
  }
}

TEST(LcpFriction, PointLeaving_FeelsNothing) {
  const LcpAnswer answer = solve(point_on_plane(1.0, -0.1, {3.0, 4.0}, 0.9));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_EQ(answer.impulses.norm(), 0.0);
}

TEST(LcpFriction, NoFriction_IsAUnilateralRow) {
  const LcpAnswer answer = solve(point_on_plane(2.0, 1.0, {3.0, 4.0}, 0.0));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_NEAR(answer.impulses[0], 2.0, 1e-9);
  EXPECT_EQ(answer.impulses.tail<2>().norm(), 0.0);
}

TEST(LcpFriction, HugeFriction_Sticks) {
  const LcpAnswer answer = solve(point_on_plane(2.0, 1e-3, {3.0, 4.0}, 1e6));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_LE(answer.velocities.norm(), 1e-8);
}

TEST(LcpFriction, InclineAtTheConesAngle_SticksJustBelowAndSlidesJustAbove) {
  const double g = 9.81, h = 0.01;
  for (const double mu : {0.1, 0.5, 1.0, 2.0}) {
    for (const double off : {-1e-6, 1e-6}) {
      const double angle = std::atan(mu * (1.0 + off));
      const double along = g * h * std::sin(angle);
      const double slip = along - mu * g * h * std::cos(angle);  // about mu g h cos(angle) off
      const LcpAnswer answer = solve(point_on_plane(1.0, g * h * std::cos(angle), {along, 0.0}, mu));
      ASSERT_EQ(answer.report.status, LcpStatus::kSolved);
      EXPECT_NEAR(answer.velocities[1], std::max(slip, 0.0), 1e-2 * std::abs(slip)) << mu << " " << off;
    }
  }
}

TEST(LcpFriction, CubeOnFourCorners_StandsStill) {
  const LcpSet set = cube_on_floor(falling_cube(0.2, 0.1, -1.0), 0.5);
  const LcpAnswer answer = solve(set);
  ASSERT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_LE(answer.velocities.norm(), 1e-9);
  double carried = 0.0;
  for (int i = 0; i < 12; i += 3) carried += answer.impulses[i];
  EXPECT_NEAR(carried, 1.0, 1e-9);
}

TEST(LcpFriction, CubeOnFourCorners_AllSlideAtTheConesAngle) {
  const double mu = 0.3;
  const LcpSet set = cube_on_floor(falling_cube(3.0, 4.0, -1.0), mu);
  const LcpAnswer answer = solve(set);
  ASSERT_EQ(answer.report.status, LcpStatus::kSolved);
  Eigen::Vector2d friction = Eigen::Vector2d::Zero();
  for (int i = 0; i < 12; i += 3) {
    EXPECT_NEAR(answer.velocities[i], 0.0, 1e-9);
    EXPECT_LE((answer.impulses.segment<2>(i + 1) + mu * answer.impulses[i] * Eigen::Vector2d(0.6, 0.8)).norm(), 1e-7);
    friction += answer.impulses.segment<2>(i + 1);
  }
  EXPECT_NEAR(friction.norm(), mu, 1e-6 * mu);
  EXPECT_NEAR(answer.velocities[1], 3.0 - 0.6 * mu, 1e-7);
  EXPECT_NEAR(answer.velocities[2], 4.0 - 0.8 * mu, 1e-7);
}

TEST(LcpFriction, SpinningCube_SlidesAllAround) {
  Eigen::VectorXd twist = falling_cube(0.0, 0.0, -1.0);
  twist[2] = 10.0;
  const LcpSet set = cube_on_floor(twist, 0.5);
  const LcpAnswer answer = solve(set);
  ASSERT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_LE(violation(set, answer.impulses), 1e-9);
  // The torque is mu times the load times the corners' distance sqrt(2), with inverse inertia 1.5.
  const double spin = 10.0 - 1.5 * 0.5 * std::numbers::sqrt2;
  EXPECT_NEAR(answer.velocities.segment<2>(1).norm(), spin * std::numbers::sqrt2, 1e-6);
}

TEST(LcpFriction, WedgeBetweenSteepWalls_JamsWithoutMoving) {
  // A point in a V of half angle 20 degrees is held by friction alone where mu exceeds tan(20 degrees).
  const double half = 20.0 * std::numbers::pi / 180.0;
  Eigen::MatrixXd jacobian(6, 3);
  jacobian << std::cos(half), 0.0, std::sin(half), std::sin(half), 0.0, -std::cos(half), 0.0, 1.0, 0.0,  //
      -std::cos(half), 0.0, std::sin(half), -std::sin(half), 0.0, -std::cos(half), 0.0, 1.0, 0.0;
  for (const Eigen::Vector3d& push : {Eigen::Vector3d(0.0, 0.0, -1.0), Eigen::Vector3d(0.3, 0.1, -1.0)}) {
    const LcpSet set{jacobian * jacobian.transpose(), jacobian * push, contacts(2, 0.8)};
    const LcpAnswer answer = solve(set);
    ASSERT_EQ(answer.report.status, LcpStatus::kSolved);
    EXPECT_LE(answer.velocities.norm(), 1e-9);
    EXPECT_LE(answer.impulses.norm(), 100.0);
  }
}

TEST(LcpFriction, BoxClosedOnByTwoPlates_IsBoundedAndReported) {
  // Two plates that close on one body at speeds that cannot both hold: no solution, however large the impulses.
  Eigen::MatrixXd jacobian(6, 3);
  jacobian << Eigen::Matrix3d::Identity(), -Eigen::Matrix3d::Identity();
  Eigen::VectorXd bias(6);
  bias << -1.0, 0.1, 0.0, -1.0, 0.0, 0.1;
  const LcpSet set{jacobian * jacobian.transpose(), bias, contacts(2, 0.5)};
  const LcpAnswer answer = solve(set);
  EXPECT_NE(answer.report.status, LcpStatus::kSolved);
  EXPECT_GE(answer.report.residual, 0.1);
  EXPECT_TRUE(is_admissible(set, answer.impulses));
  EXPECT_LE(answer.impulses.lpNorm<Eigen::Infinity>(), 1e7);
}

TEST(LcpFriction, TorsionWithGivenNormalForce_BrakesUpToItsLimit) {
  // A spin about the normal beside the contact: a box row of half-width mu_torsion * radius * normal force.
  LcpSet set{Eigen::MatrixXd::Identity(4, 4), Eigen::Vector4d(-1.0, 0.0, 0.0, 5.0), contacts(1, 0.5)};
  set.rows.push_back(LcpRow::box(-0.02, 0.02));
  const LcpAnswer answer = solve(set);
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_DOUBLE_EQ(answer.impulses[3], -0.02);
  EXPECT_NEAR(answer.velocities[3], 4.98, 1e-12);
}

}  // namespace
}  // namespace layfigure::testing
