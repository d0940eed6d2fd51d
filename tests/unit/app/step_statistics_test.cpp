#include "layfigure/app/step_statistics.h"

#include <gtest/gtest.h>

namespace layfigure::app {
namespace {

TEST(StepStatistics, WithoutSteps_IsZero) {
  const StepSummary summary = StepStatistics(1000.0).summary();
  EXPECT_EQ(summary.cpu_us_max, 0.0);
  EXPECT_EQ(summary.realtime_factor, 0.0);
}

TEST(StepStatistics, OneToAHundred_GivesThePercentiles) {
  StepStatistics statistics(1000.0);
  for (int i = 101; i >= 1; --i) statistics.record({static_cast<double>(i), 20.0});
  const StepSummary summary = statistics.summary();
  EXPECT_EQ(summary.cpu_us_p50, 51.0);
  EXPECT_EQ(summary.cpu_us_p99, 100.0);
  EXPECT_EQ(summary.cpu_us_max, 101.0);
  EXPECT_NEAR(summary.realtime_factor, 50.0, 1e-9);  // a step of 1000 us in 20 us
}

TEST(StepStatistics, MoreThanASecond_ForgetsTheOldest) {
  StepStatistics statistics(10.0);
  for (int i = 0; i < 25; ++i) statistics.record({1000.0, 1.0});
  for (int i = 0; i < 10; ++i) statistics.record({5.0, 1.0});
  EXPECT_EQ(statistics.summary().cpu_us_max, 5.0);
}

}  // namespace
}  // namespace layfigure::app
