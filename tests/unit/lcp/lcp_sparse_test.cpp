#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "lcp_checks.h"

namespace layfigure::testing {
namespace {

using dynamics::LcpStatus;

// Of two answers that are each solved to 1e-10, in sets whose conditions go up to 1e3.
constexpr double kAgreement = 1e-6;

constexpr int kBlocksPerPair = 4;  ///< of three rows, between a body and the next
constexpr int kFreedoms = 12;      ///< of a body: as many as rows, so that no row is redundant

/// A row of bodies of which each touches the next one alone, but for every `gap`-th, which does not.
LcpSet chain(int bodies, int gap, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  LcpSet set;
  std::vector<Eigen::MatrixXd> pairs;
  for (int body = 0; body + 1 < bodies; ++body) {
    if (body % gap == gap - 1) continue;
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * kBlocksPerPair, kFreedoms * bodies);
    jacobian.middleCols(kFreedoms * body, 2 * kFreedoms) =
        Eigen::MatrixXd::NullaryExpr(3 * kBlocksPerPair, 2 * kFreedoms, draw);
    pairs.push_back(jacobian);
    // Little friction: then Coulomb's law has one solution.
    for (int k = 0; k + 1 < kBlocksPerPair; ++k) add_contact(0.2, set.rows);
    set.rows.insert(set.rows.end(),
                    {dynamics::LcpRow::unilateral(), dynamics::LcpRow::box(-0.1, 0.1), dynamics::LcpRow::equality()});
  }
  Eigen::MatrixXd jacobian(set.size(), kFreedoms * bodies);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    jacobian.middleRows(3 * kBlocksPerPair * static_cast<Eigen::Index>(k), 3 * kBlocksPerPair) = pairs[k];
  }
  set.delassus = jacobian * jacobian.transpose();
  set.bias = jacobian * Eigen::VectorXd::NullaryExpr(jacobian.cols(), draw);
  return set;
}

/// The rows from blocks of three, in their order there.
std::vector<int> rows_of(const std::vector<int>& blocks) {
  std::vector<int> rows;
  for (const int block : blocks) rows.insert(rows.end(), {3 * block, 3 * block + 1, 3 * block + 2});
  return rows;
}

LcpSet picked(const LcpSet& set, const std::vector<int>& rows) {
  LcpSet some{.delassus = set.delassus(rows, rows), .bias = set.bias(rows), .rows = {}};
  for (const int row : rows) some.rows.push_back(set.rows[row]);
  return some;
}

TEST(LcpSparse, ChainOfBodies_MovesTheSameWhateverTheOrderOfItsRows) {
  std::mt19937 random(31);
  for (int k = 0; k < 10; ++k) {
    const LcpSet set = chain(12, 5, random);
    const LcpAnswer answer = solve(set);
    ASSERT_EQ(answer.report.status, LcpStatus::kSolved) << k;
    EXPECT_LE(violation(set, answer.impulses), 1e-8) << k;
    std::vector<int> blocks(set.size() / 3);
    std::iota(blocks.begin(), blocks.end(), 0);
    std::shuffle(blocks.begin(), blocks.end(), random);
    const std::vector<int> rows = rows_of(blocks);
    const LcpAnswer shuffled = solve(picked(set, rows));
    ASSERT_EQ(shuffled.report.status, LcpStatus::kSolved) << k;
    const Eigen::VectorXd expected = answer.velocities(rows);
    EXPECT_LE((shuffled.velocities - expected).norm(), kAgreement * (1.0 + set.bias.norm())) << k;
  }
}

TEST(LcpSparse, BodiesApart_MoveAsEachPairAlone) {
  std::mt19937 random(32);
  for (int k = 0; k < 10; ++k) {
    const LcpSet set = chain(10, 2, random);
    const LcpAnswer answer = solve(set);
    ASSERT_EQ(answer.report.status, LcpStatus::kSolved) << k;
    constexpr int kRows = 3 * kBlocksPerPair;
    for (int first = 0; first < set.size(); first += kRows) {
      std::vector<int> rows(kRows);
      std::iota(rows.begin(), rows.end(), first);
      const LcpAnswer alone = solve(picked(set, rows));
      ASSERT_EQ(alone.report.status, LcpStatus::kSolved) << k << " " << first;
      const Eigen::VectorXd together = answer.velocities.segment(first, kRows);
      EXPECT_LE((alone.velocities - together).norm(), kAgreement * (1.0 + set.bias.norm())) << k << " " << first;
    }
  }
}

}  // namespace
}  // namespace layfigure::testing
