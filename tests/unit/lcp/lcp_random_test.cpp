#include <gtest/gtest.h>

#include <cmath>

#include "lcp_checks.h"
#include "lcp_reference.h"

namespace layfigure::testing {
namespace {

using dynamics::kLcpTolerance;
using dynamics::LcpRow;
using dynamics::LcpStatus;

constexpr unsigned kSeed = 20261122;
// Velocities and impulses of order one, residuals of 1e-10, condition numbers up to some 1e4.
constexpr double kAgreement = 1e-6;

TEST(LcpRandom, SmallSets_AgreeWithEnumeration) {
  std::mt19937 random(kSeed);
  for (int k = 0; k < 300; ++k) {
    const int blocks = 1 + k % 2;
    const LcpSet set =
        random_set({.blocks = blocks, .rank = 3 * blocks + 2, .contact_share = 0.0, .consistent = false}, random);
    const LcpAnswer answer = solve(set);
    ASSERT_EQ(answer.report.status, LcpStatus::kSolved) << k;
    const Eigen::VectorXd expected = solve_by_enumeration(set);
    EXPECT_LE((answer.impulses - expected).norm(), kAgreement * (1.0 + expected.norm())) << k;
  }
}

/// Redundant sets have many impulses for the one motion, so the motions are compared.
void expect_agreement(const RandomLcp& kind, int count) {
  std::mt19937 random(kSeed);
  int compared = 0;
  for (int k = 0; k < count; ++k) {
    const LcpSet set = random_set(kind, random);
    const LcpAnswer answer = solve(set);
    ASSERT_EQ(answer.report.status, LcpStatus::kSolved) << k;
    EXPECT_LE(answer.report.residual, kLcpTolerance) << k;
    EXPECT_LE(violation(set, answer.impulses), 1e-8) << k;
    const ReferenceAnswer reference = solve_by_gauss_seidel(set);
    if (!reference.converged) continue;
    ++compared;
    const Eigen::VectorXd expected = set.delassus * reference.impulses + set.bias;
    EXPECT_LE((answer.velocities - expected).norm(), kAgreement * (1.0 + set.bias.norm())) << k;
  }
  EXPECT_GE(compared, count / 2);
}

TEST(LcpRandom, BoxSetsOfFullRank_AgreeWithGaussSeidel) {
  expect_agreement({.blocks = 4, .rank = 20, .contact_share = 0.0, .consistent = false}, 60);
  expect_agreement({.blocks = 20, .rank = 100, .contact_share = 0.0, .consistent = false}, 10);
}

TEST(LcpRandom, RedundantBoxSets_AgreeWithGaussSeidel) {
  expect_agreement({.blocks = 4, .rank = 8, .contact_share = 0.0}, 60);
  expect_agreement({.blocks = 20, .rank = 30, .contact_share = 0.0}, 10);
}

TEST(LcpRandom, ContactsOfFullRank_AgreeWithGaussSeidel) {
  // Little friction: then Coulomb's law has one solution.
  expect_agreement({.blocks = 1, .rank = 5, .contact_share = 1.0, .largest_friction = 0.3}, 60);
  expect_agreement({.blocks = 12, .rank = 60, .contact_share = 1.0, .largest_friction = 0.3}, 20);
  expect_agreement({.blocks = 20, .rank = 100, .contact_share = 1.0, .largest_friction = 0.3}, 10);
}

TEST(LcpRandom, EverythingTogether_AgreesWithGaussSeidel) {
  expect_agreement({.blocks = 12, .rank = 60, .largest_friction = 0.3, .consistent = false}, 30);
}

TEST(LcpRandom, RedundantContacts_AreSolved) {
  std::mt19937 random(kSeed);
  for (const int rank : {1, 3, 6, 18}) {
    for (int k = 0; k < 100; ++k) {
      const LcpSet set = random_set({.blocks = 12, .rank = rank, .contact_share = 1.0}, random);
      const LcpAnswer answer = solve(set);
      EXPECT_EQ(answer.report.status, LcpStatus::kSolved) << rank << " " << k;
      EXPECT_TRUE(is_admissible(set, answer.impulses));
      EXPECT_LE(violation(set, answer.impulses), 1e-8) << rank << " " << k;
    }
  }
}

TEST(LcpRandom, BoxSetsWithoutConsistency_AreSolvedOrInfeasible) {
  std::mt19937 random(kSeed);
  int infeasible = 0;
  for (int k = 0; k < 300; ++k) {
    const LcpSet set = random_set({.blocks = 4, .rank = 7, .contact_share = 0.0, .consistent = false}, random);
    const LcpAnswer answer = solve(set);
    EXPECT_NE(answer.report.status, LcpStatus::kIterationLimit) << k;
    EXPECT_TRUE(is_admissible(set, answer.impulses));
    if (answer.report.status != LcpStatus::kInfeasible) continue;
    ++infeasible;
    EXPECT_GT(answer.report.residual, kLcpTolerance);
  }
  EXPECT_GT(infeasible, 0);
  EXPECT_LT(infeasible, 300);
}

/// Breaks a set in one of the ways that contact code breaks them.
void spoil(LcpSet& set, int way, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const int n = set.size();
  const Eigen::VectorXd wild = Eigen::VectorXd::NullaryExpr(n, [&] { return std::exp(6.0 * normal(random)); });
  switch (way % 6) {
    case 0:  // rows in wild units
      set.delassus = (wild.asDiagonal() * set.delassus * wild.asDiagonal()).eval();
      set.bias = (wild.asDiagonal() * set.bias).eval();
      break;
    case 1:  // a block that nothing moves
      set.delassus.middleRows(0, 3).setZero();
      set.delassus.middleCols(0, 3).setZero();
      break;
    case 2:  // not quite positive semidefinite
      set.delassus.diagonal().array() -= 1e-12 * set.delassus.trace();
      break;
    case 3:  // friction far beyond any material
      for (LcpRow& row : set.rows) row.friction *= 1e3;
      break;
    case 4:  // velocities of all sizes
      set.bias = set.bias.cwiseProduct(wild);
      break;
    default:  // plainly not positive semidefinite
      set.delassus.diagonal().array() -= 0.1 * set.delassus.trace() / n;
  }
}

TEST(LcpRandom, TenThousandNastySets_AreBoundedAndReported) {
  std::mt19937 random(kSeed);
  for (int k = 0; k < 10000; ++k) {
    const RandomLcp kind{.blocks = 1 + k % 4, .rank = 1 + k % 11, .largest_friction = 1.5, .consistent = k % 3 != 0};
    LcpSet set = random_set(kind, random);
    spoil(set, k, random);
    const LcpAnswer answer = solve(set);
    ASSERT_NE(answer.report.status, LcpStatus::kInvalid) << k;
    ASSERT_TRUE(is_admissible(set, answer.impulses)) << k;
    ASSERT_TRUE(std::isfinite(answer.report.residual)) << k;
    ASSERT_EQ(answer.report.status == LcpStatus::kSolved, answer.report.residual <= kLcpTolerance) << k;
  }
}

}  // namespace
}  // namespace layfigure::testing
