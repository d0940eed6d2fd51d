#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "lcp_checks.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

// The solver's memory is in standard containers: every way to the heap that it has goes through these.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace layfigure::testing {
namespace {

TEST(LcpAllocation, WithinTheReservedSize_IsNone) {
  dynamics::LcpWorkspace workspace;
  workspace.reserve(36);
  std::mt19937 random(5);
  for (int k = 0; k < 200; ++k) {
    // Hard and impossible sets too, so that every path is taken.
    const LcpSet set = random_set({.blocks = 12 - k % 12, .rank = 6, .consistent = k % 2 == 0}, random);
    Eigen::VectorXd impulses = Eigen::VectorXd::Zero(set.size());
    const long before = allocations;
    const auto report = dynamics::solve_lcp(set.delassus, set.bias, set.rows, impulses, workspace);
    EXPECT_EQ(allocations, before) << k;
    EXPECT_TRUE(impulses.allFinite()) << static_cast<int>(report.status);
  }
}

}  // namespace
}  // namespace layfigure::testing
