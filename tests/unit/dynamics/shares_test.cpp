#include "shares.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace layfigure::dynamics {
namespace {

std::vector<int> ends_of(const Shares& shares) { return {shares.ends.begin(), shares.ends.begin() + shares.count + 1}; }

// Slots of a doll of 52 joints, which take more the more runs go side by side, and of a chain of 60, where four runs
// take those of one.
constexpr std::array kDoll{16.0, 27.0, 40.0, 52.0, 65.0, 78.0};
constexpr std::array kChain{75.0, 60.0, 60.0, 60.0, 75.0, 90.0};

Shares doll_shares(int order, int threads) { return share_runs(std::span(kDoll).first(order), 52, threads); }
Shares chain_shares(int order, int threads) { return share_runs(std::span(kChain).first(order), 60, threads); }

TEST(Shares, OneThread_HasAllRuns) {
  for (int order = 1; order <= kMaxOrder; ++order) {
    EXPECT_EQ(ends_of(doll_shares(order, 1)), (std::vector{0, order}));
  }
}

TEST(Shares, OneRun_IsNotShared) { EXPECT_EQ(ends_of(doll_shares(1, 4)), (std::vector{0, 1})); }

TEST(Shares, Doll_TheLongestIsShort) {
  // Runs 0 to 2 take 40 + 27 + 16 slots, run 3 takes 4 x 16; all together 52 + 40 + 27 + 16.
  EXPECT_EQ(ends_of(doll_shares(4, 2)), (std::vector{0, 3, 4}));
}

TEST(Shares, Chain_WhoseRunsGoSideBySideAnyway_IsNotShared) {
  for (int order = 1; order <= kMaxOrder; ++order) EXPECT_EQ(chain_shares(order, 2).count, 1) << order;
}

TEST(Shares, FewBodies_AreNotWorthASecondThread) {
  EXPECT_EQ(share_runs(std::array{1.0, 2.0, 3.0, 4.0}, 4, 4).count, 1);
}

TEST(Shares, ShortOrder_WhoseRunsComeDearer_IsNotShared) { EXPECT_EQ(doll_shares(2, 2).count, 1); }

TEST(Shares, AnyNumberOfThreads_HaveEveryRunOnce) {
  for (int order = 1; order <= kMaxOrder; ++order) {
    for (int threads = 1; threads <= 8; ++threads) {
      const Shares shares = doll_shares(order, threads);
      EXPECT_LE(shares.count, threads);
      EXPECT_EQ(shares.ends[0], 0);
      EXPECT_EQ(shares.ends[shares.count], order);
      for (int k = 0; k < shares.count; ++k) EXPECT_LT(shares.ends[k], shares.ends[k + 1]);
    }
  }
}

}  // namespace
}  // namespace layfigure::dynamics
