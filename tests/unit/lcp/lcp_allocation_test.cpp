#include <gtest/gtest.h>

#include "allocation_count.h"
#include "lcp_checks.h"

namespace layfigure::testing {
namespace {

// The solver's memory is in standard containers, which go through operator new.
TEST(LcpAllocation, WithinTheReservedSize_IsNone) {
  dynamics::LcpWorkspace workspace;
  workspace.reserve(36);
  std::mt19937 random(5);
  for (int k = 0; k < 200; ++k) {
    // Hard and impossible sets too, so that every path is taken.
    const LcpSet set = random_set({.blocks = 12 - k % 12, .rank = 6, .consistent = k % 2 == 0}, random);
    Eigen::VectorXd impulses = Eigen::VectorXd::Zero(set.size());
    const long before = allocation_count();
    const auto report = dynamics::solve_lcp(set.delassus, set.bias, set.rows, impulses, workspace);
    EXPECT_EQ(allocation_count(), before) << k;
    EXPECT_TRUE(impulses.allFinite()) << static_cast<int>(report.status);
  }
}

}  // namespace
}  // namespace layfigure::testing
