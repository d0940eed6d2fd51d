#include "layfigure/dynamics/lcp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lcp_checks.h"

namespace layfigure::testing {
namespace {

using dynamics::kLcpTolerance;
using dynamics::LcpRow;
using dynamics::LcpRowKind;
using dynamics::LcpStatus;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double kInfinity = LcpRow::kInfinity;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kTight = 1e-10;

LcpSet single(double a, double b, const LcpRow& row) {
  return {Matrix::Constant(1, 1, a), Vector::Constant(1, b), {row}};
}

void expect_solved(const LcpSet& set, const LcpAnswer& answer) {
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_LE(answer.report.residual, kLcpTolerance);
  EXPECT_TRUE(is_admissible(set, answer.impulses));
  EXPECT_LE(violation(set, answer.impulses), 1e-9);
}

TEST(Lcp, NoRows_IsSolvedAtOnce) {
  const LcpAnswer answer = solve({Matrix(0, 0), Vector(0), {}});
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_EQ(answer.report.iterations, 0);
  EXPECT_EQ(answer.report.worst_row, -1);
}

TEST(Lcp, Equality_StopsTheRow) {
  const LcpAnswer answer = solve(single(2.0, 3.0, LcpRow::equality()));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_NEAR(answer.impulses[0], -1.5, 1e-10);
}

TEST(Lcp, UnilateralApproaching_Stops) {
  const LcpAnswer answer = solve(single(2.0, -3.0, LcpRow::unilateral()));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_NEAR(answer.impulses[0], 1.5, 1e-10);
}

TEST(Lcp, UnilateralLeaving_IsLetGo) {
  const LcpAnswer answer = solve(single(2.0, 3.0, LcpRow::unilateral()));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_EQ(answer.impulses[0], 0.0);
  EXPECT_EQ(answer.velocities[0], 3.0);
}

TEST(Lcp, Box_HoldsUpToItsBounds) {
  const LcpRow box = LcpRow::box(-0.5, 0.25);
  EXPECT_NEAR(solve(single(2.0, 0.4, box)).impulses[0], -0.2, 1e-11);
  EXPECT_DOUBLE_EQ(solve(single(2.0, 9.0, box)).impulses[0], -0.5);
  EXPECT_DOUBLE_EQ(solve(single(2.0, -9.0, box)).impulses[0], 0.25);
}

TEST(Lcp, BoxWithoutZero_StartsFromItsNearerBound) {
  const LcpSet set = single(2.0, 0.0, LcpRow::box(0.5, 0.75));
  const LcpAnswer answer = solve(set);
  expect_solved(set, answer);
  EXPECT_DOUBLE_EQ(answer.impulses[0], 0.5);
}

TEST(Lcp, BoxOfOnePoint_IsThatPoint) {
  const LcpAnswer answer = solve(single(2.0, 7.0, LcpRow::box(0.5, 0.5)));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_DOUBLE_EQ(answer.impulses[0], 0.5);
}

TEST(Lcp, NothingMoves_NoImpulse) {
  const LcpSet set{
      Matrix::Identity(3, 3), Vector::Zero(3), {LcpRow::contact(0.5), LcpRow::tangent(), LcpRow::tangent()}};
  const LcpAnswer answer = solve(set);
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_EQ(answer.impulses, Vector::Zero(3));
}

TEST(Lcp, OnlyTheLowerTriangle_IsRead) {
  LcpSet set{Matrix{{2.0, kNaN}, {1.0, 2.0}}, Vector{{-1.0, -1.0}}, {LcpRow::unilateral(), LcpRow::unilateral()}};
  const LcpAnswer answer = solve(set);
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_NEAR(answer.impulses[0], 1.0 / 3.0, kTight);
  EXPECT_NEAR(answer.impulses[1], 1.0 / 3.0, kTight);
}

TEST(Lcp, OtherUnits_GiveTheSameMotion) {
  std::mt19937 random(3);
  const LcpSet set = random_set({.blocks = 6, .rank = 20}, random);
  LcpSet scaled = set;
  scaled.delassus *= 1e-9;
  scaled.bias *= 1e5;
  for (LcpRow& row : scaled.rows) {
    row.lower *= 1e14;
    row.upper *= 1e14;
  }
  const LcpAnswer answer = solve(set);
  const LcpAnswer other = solve(scaled);
  expect_solved(set, answer);
  expect_solved(scaled, other);
  EXPECT_LE((other.velocities * 1e-5 - answer.velocities).norm(), 1e-8);
}

TEST(Lcp, MassRatioOfAMillion_IsSolved) {
  // A light body between a heavy one that falls on it and the floor: J M^-1 J^T of two unilateral rows.
  const LcpSet set{
      Matrix{{1.0, -1.0}, {-1.0, 1.0 + 1e-6}}, Vector{{0.0, -1.0}}, {LcpRow::unilateral(), LcpRow::unilateral()}};
  const LcpAnswer answer = solve(set);
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_LE(answer.velocities.norm(), 1e-9);
  EXPECT_NEAR(answer.impulses[0], 1e6, 1.0);
  EXPECT_NEAR(answer.impulses[1], 1e6, 1.0);
}

TEST(Lcp, DuplicateRows_ShareTheLoad) {
  const LcpSet set{Matrix::Constant(4, 4, 2.0), Vector::Constant(4, -1.0),
                   std::vector<LcpRow>(4, LcpRow::unilateral())};
  const LcpAnswer answer = solve(set);
  expect_solved(set, answer);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(answer.impulses[i], 0.125, 1e-9);
}

TEST(Lcp, RedundantEqualities_AreSolved) {
  const Vector row{{1.0, -2.0, 0.5}};
  const LcpSet set{row * row.transpose(), 3.0 * row, std::vector<LcpRow>(3, LcpRow::equality())};
  const LcpAnswer answer = solve(set);
  expect_solved(set, answer);
  EXPECT_LE(answer.velocities.norm(), 1e-9);
  EXPECT_LE(answer.impulses.norm(), 10.0);
}

TEST(Lcp, RowThatNothingMoves_IsLeftAloneIfItMay) {
  const LcpSet set{Matrix{{1.0, 0.0}, {0.0, 0.0}}, Vector{{-1.0, 0.5}}, {LcpRow::unilateral(), LcpRow::unilateral()}};
  const LcpAnswer answer = solve(set);
  expect_solved(set, answer);
  EXPECT_EQ(answer.impulses[1], 0.0);
}

TEST(Lcp, RowThatNothingMovesButMust_IsInfeasible) {
  for (const LcpRow& row : {LcpRow::unilateral(), LcpRow::equality()}) {
    const LcpAnswer answer = solve(single(0.0, -0.5, row));
    EXPECT_EQ(answer.report.status, LcpStatus::kInfeasible);
    EXPECT_TRUE(std::isfinite(answer.impulses[0]));
    EXPECT_EQ(answer.report.worst_row, 0);
  }
}

TEST(Lcp, BoxThatNothingMoves_GoesToItsBound) {
  const LcpAnswer answer = solve(single(0.0, -0.5, LcpRow::box(-1.0, 2.0)));
  EXPECT_EQ(answer.report.status, LcpStatus::kSolved);
  EXPECT_DOUBLE_EQ(answer.impulses[0], 2.0);
}

TEST(Lcp, ContradictingEqualities_GiveLeastSquaresAndSaySo) {
  // One body, told to move at -1 and at -3 by two equal rows, and a third row that is fine.
  Matrix delassus = Matrix::Constant(3, 3, 1.0);
  delassus.row(2).setZero();
  delassus.col(2).setZero();
  delassus(2, 2) = 4.0;
  const LcpSet set{delassus, Vector{{1.0, 3.0, 2.0}}, std::vector<LcpRow>(3, LcpRow::equality())};
  const LcpAnswer answer = solve(set);
  EXPECT_EQ(answer.report.status, LcpStatus::kInfeasible);
  EXPECT_NEAR(answer.velocities[0], -1.0, 1e-4);
  EXPECT_NEAR(answer.velocities[1], 1.0, 1e-4);
  EXPECT_NEAR(answer.velocities[2], 0.0, 1e-4);
  EXPECT_LE(answer.impulses.lpNorm<Eigen::Infinity>(), 1e6 * set.bias.norm());
  EXPECT_NEAR(answer.report.residual, 1.0 / 3.0, 1e-4);
}

TEST(Lcp, SqueezedBetweenTwoWalls_IsInfeasibleAndBalanced) {
  // Both walls press against the same body.
  const LcpSet set{
      Matrix{{1.0, -1.0}, {-1.0, 1.0}}, Vector{{-1.0, -1.0}}, {LcpRow::unilateral(), LcpRow::unilateral()}};
  const LcpAnswer answer = solve(set);
  EXPECT_EQ(answer.report.status, LcpStatus::kInfeasible);
  EXPECT_NEAR(answer.velocities[0], -1.0, 1e-4);
  EXPECT_NEAR(answer.velocities[1], -1.0, 1e-4);
  EXPECT_TRUE(is_admissible(set, answer.impulses));
}

TEST(Lcp, Start_IsTakenIntoTheBoundsFirst) {
  const LcpSet set = single(2.0, -3.0, LcpRow::unilateral());
  for (const double start : {-5.0, kNaN, kInfinity, 1e300}) {
    const LcpAnswer answer = solve(set, Vector::Constant(1, start));
    EXPECT_EQ(answer.report.status, LcpStatus::kSolved) << start;
    EXPECT_NEAR(answer.impulses[0], 1.5, 1e-9) << start;
  }
}

TEST(Lcp, StartAtTheSolution_TakesNoIteration) {
  std::mt19937 random(11);
  const LcpSet set = random_set({.blocks = 8, .rank = 26}, random);
  const LcpAnswer first = solve(set);
  ASSERT_EQ(first.report.status, LcpStatus::kSolved);
  EXPECT_EQ(solve(set, first.impulses).report.iterations, 0);
}

TEST(Lcp, StartNearTheSolution_TakesOneOrTwoIterations) {
  std::mt19937 random(12);
  std::normal_distribution<double> normal;
  int most = 0;
  for (int k = 0; k < 200; ++k) {
    LcpSet set = random_set({.blocks = 6, .rank = 20, .largest_friction = 0.8}, random);
    const LcpAnswer first = solve(set);
    ASSERT_EQ(first.report.status, LcpStatus::kSolved);
    for (double& b : set.bias) b += 1e-7 * normal(random);
    const LcpAnswer next = solve(set, first.impulses);
    EXPECT_EQ(next.report.status, LcpStatus::kSolved);
    most = std::max(most, next.report.iterations);
  }
  EXPECT_LE(most, 2);
}

TEST(Lcp, SameProblemTwice_GivesTheSameBits) {
  std::mt19937 random(13);
  dynamics::LcpWorkspace used;
  for (int k = 0; k < 50; ++k) {
    const LcpSet set = random_set({.blocks = 2 + k % 7, .rank = 9, .largest_friction = 2.0}, random);
    Vector again = Vector::Zero(set.size());
    const auto report = dynamics::solve_lcp(set.delassus, set.bias, set.rows, again, used);
    const LcpAnswer fresh = solve(set);
    EXPECT_EQ(fresh.impulses, again);
    EXPECT_EQ(fresh.report.iterations, report.iterations);
  }
}

struct Invalid {
  const char* what;
  LcpSet set;
};

class LcpInvalid : public ::testing::TestWithParam<Invalid> {};

TEST_P(LcpInvalid, IsReported_WithZeroImpulses) {
  const LcpSet& set = GetParam().set;
  const LcpAnswer answer = solve(set, Vector::Ones(set.size()));
  EXPECT_EQ(answer.report.status, LcpStatus::kInvalid) << GetParam().what;
  EXPECT_EQ(answer.impulses, Vector::Zero(set.size()));
}

INSTANTIATE_TEST_SUITE_P(
    All, LcpInvalid,
    ::testing::Values(Invalid{"matrix is NaN", single(kNaN, 1.0, LcpRow::equality())},
                      Invalid{"matrix is infinite", single(kInfinity, 1.0, LcpRow::equality())},
                      Invalid{"matrix is negative", single(-1e3, -1.0, LcpRow::unilateral())},
                      Invalid{"bias is NaN", single(1.0, kNaN, LcpRow::equality())},
                      Invalid{"bias is infinite", single(1.0, -kInfinity, LcpRow::unilateral())},
                      Invalid{"bounds are crossed", single(1.0, 1.0, LcpRow::box(1.0, 0.0))},
                      Invalid{"a bound is NaN", single(1.0, 1.0, LcpRow::box(kNaN, 0.0))},
                      Invalid{"the interval is at infinity", single(1.0, 1.0, LcpRow::box(kInfinity, kInfinity))},
                      Invalid{"a tangent has no contact", single(1.0, 1.0, LcpRow::tangent())},
                      Invalid{"a contact has no tangents", single(1.0, 1.0, LcpRow::contact(0.5))},
                      Invalid{"a contact has one tangent",
                              {Matrix::Identity(2, 2), Vector::Ones(2), {LcpRow::contact(0.5), LcpRow::tangent()}}},
                      Invalid{"friction is negative",
                              {Matrix::Identity(3, 3),
                               Vector::Ones(3),
                               {LcpRow::contact(-0.5), LcpRow::tangent(), LcpRow::tangent()}}},
                      Invalid{"friction is infinite",
                              {Matrix::Identity(3, 3),
                               Vector::Ones(3),
                               {LcpRow::contact(kInfinity), LcpRow::tangent(), LcpRow::tangent()}}}));

}  // namespace
}  // namespace layfigure::testing
