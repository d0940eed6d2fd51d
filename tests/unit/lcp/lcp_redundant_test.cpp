#include <gtest/gtest.h>

#include <Eigen/LU>

#include "lcp_checks.h"

namespace layfigure::testing {
namespace {

using dynamics::LcpStatus;

/// Links of length 1 and mass 1 that lie in a row on a floor, with ball joints between them: capsules, of which each
/// touches at two points of its axis. Friction along an axis is redundant, and the joints make more so.
constexpr double kTouch = 0.4;  ///< of the points, from the middle of a link

/// Velocity of a point at `x` from a link's first joint, over [velocity of the first joint; spins of the links].
Eigen::MatrixXd point_jacobian(int links, int link, double x, double slope) {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3, 3 + 3 * links);
  jacobian.leftCols<3>().setIdentity();
  for (int k = 0; k <= link; ++k) {
    const double along = k < link ? 1.0 : x;
    const Eigen::Vector3d arm = along * Eigen::Vector3d(1.0, 0.0, k % 2 == 0 ? slope : -slope);
    jacobian.middleCols<3>(3 + 3 * k) << 0.0, arm.z(), -arm.y(), -arm.z(), 0.0, arm.x(), arm.y(), -arm.x(), 0.0;
  }
  return jacobian;
}

/// The row on its floor after a step of gravity, with gaps that no motion closes together.
LcpSet lying_row(int links, double slope, double mu, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const int freedoms = 3 + 3 * links;
  Eigen::MatrixXd mass = Eigen::MatrixXd::Zero(freedoms, freedoms);
  Eigen::VectorXd impulse = Eigen::VectorXd::Zero(freedoms);
  LcpSet set;
  Eigen::MatrixXd jacobian(6 * links, freedoms);
  for (int k = 0; k < links; ++k) {
    const Eigen::MatrixXd com = point_jacobian(links, k, 0.5, slope);
    mass += com.transpose() * com;
    mass.diagonal().segment<3>(3 + 3 * k) += Eigen::Vector3d(0.005, 0.08, 0.08);
    impulse -= com.row(2).transpose();
    for (int side = 0; side < 2; ++side) {
      const Eigen::MatrixXd point = point_jacobian(links, k, 0.5 + (side == 0 ? -kTouch : kTouch), slope);
      const int row = 6 * k + 3 * side;
      jacobian.row(row) = point.row(2);
      jacobian.row(row + 1) = point.row(0);
      jacobian.row(row + 2) = point.row(1);
      add_contact(mu, set.rows);
    }
  }
  const Eigen::MatrixXd inverse = mass.inverse();
  set.delassus = jacobian * inverse * jacobian.transpose();
  const Eigen::VectorXd push = 0.1 * Eigen::VectorXd::NullaryExpr(freedoms, [&] { return normal(random); });
  set.bias = jacobian * inverse * (impulse + push);
  for (int i = 0; i < set.size(); i += 3) set.bias[i] += 1e-2 * normal(random);
  return set;
}

TEST(LcpRedundant, LinkThatLiesAskew_IsSolvedInFewIterations) {
  // Friction along the axis holds both ends, whose gaps would have the link turn: one of them has to slip a little.
  std::mt19937 random(21);
  for (const double mu : {0.2, 0.5, 1.0}) {
    for (int k = 0; k < 100; ++k) {
      const LcpSet set = lying_row(1, 0.01, mu, random);
      const LcpAnswer answer = solve(set);
      ASSERT_EQ(answer.report.status, LcpStatus::kSolved) << mu << " " << k;
      EXPECT_LE(violation(set, answer.impulses), 1e-8) << mu << " " << k;
      EXPECT_LE(answer.report.iterations, 48) << mu << " " << k;
    }
  }
}

TEST(LcpRedundant, NextStepOfALinkAskew_StartsFromTheLast) {
  std::mt19937 random(22);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 100; ++k) {
    LcpSet set = lying_row(1, 0.01, 0.5, random);
    const LcpAnswer last = solve(set);
    for (int i = 0; i < set.size(); i += 3) set.bias[i] += 1e-3 * normal(random);
    const LcpAnswer next = solve(set, last.impulses);
    ASSERT_EQ(next.report.status, LcpStatus::kSolved) << k;
    EXPECT_LE(next.report.iterations, 30) << k;
  }
}

TEST(LcpRedundant, FlatRowOfLinks_TakesFewIterationsOnAverage) {
  std::mt19937 random(23);
  constexpr int kSets = 100;
  int iterations = 0;
  int solved = 0;
  for (int k = 0; k < kSets; ++k) {
    const LcpAnswer answer = solve(lying_row(5, 0.0, 0.5, random));
    iterations += answer.report.iterations;
    if (answer.report.status == LcpStatus::kSolved) ++solved;
  }
  EXPECT_LE(iterations, 16 * kSets);
  EXPECT_GE(solved, kSets - 2);  // Coulomb's law may have no solution
}

}  // namespace
}  // namespace layfigure::testing
