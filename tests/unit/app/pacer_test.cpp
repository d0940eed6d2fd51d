#include "layfigure/app/pacer.h"

#include <gtest/gtest.h>

namespace layfigure::app {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

const Pacer::Clock::time_point kStart{std::chrono::hours(1)};

TEST(Pacer, Deadlines_DoNotDrift) {
  Pacer pacer(3000.0, kStart);  // a period of 333 333.3 ns
  for (int i = 1; i <= 3000; ++i) {
    EXPECT_NEAR(static_cast<double>((pacer.deadline() - kStart).count()), i * 1e9 / 3000.0, 1.0);
    pacer.begin_step(pacer.deadline());
  }
  EXPECT_EQ(pacer.late_steps(), 0);
}

TEST(Pacer, MoreThanAPeriodLate_Counted) {
  Pacer pacer(1000.0, kStart);
  pacer.begin_step(pacer.deadline() + nanoseconds(1'000'000));
  EXPECT_EQ(pacer.late_steps(), 0);
  pacer.begin_step(pacer.deadline() + nanoseconds(1'000'001));
  EXPECT_EQ(pacer.late_steps(), 1);
  EXPECT_EQ(pacer.dropped_time(), 0.0);
}

TEST(Pacer, ALittleBehind_CatchesUp) {
  Pacer pacer(1000.0, kStart);
  const auto now = kStart + milliseconds(100);
  int steps = 0;
  while (pacer.deadline() <= now) {
    pacer.begin_step(now);
    ++steps;
  }
  EXPECT_EQ(steps, 100);
  EXPECT_EQ(pacer.dropped_time(), 0.0);
}

TEST(Pacer, FarBehind_DropsTimeInsteadOfCatchingUp) {
  Pacer pacer(1000.0, kStart);
  const auto now = kStart + milliseconds(5001);
  int steps = 0;
  while (pacer.deadline() <= now) {
    pacer.begin_step(now);
    ++steps;
  }
  EXPECT_EQ(steps, 1);
  EXPECT_DOUBLE_EQ(pacer.dropped_time(), 5.0);
  EXPECT_EQ(pacer.deadline(), now + milliseconds(1));
}

TEST(Pacer, PassOver_TakesAllThatIsDueForDone) {
  Pacer pacer(1000.0, kStart);
  EXPECT_EQ(pacer.pass_over(kStart), 0);
  EXPECT_EQ(pacer.pass_over(kStart + milliseconds(5000)), 5000);
  EXPECT_EQ(pacer.pass_over(kStart + milliseconds(5000)), 0);
  EXPECT_EQ(pacer.deadline(), kStart + milliseconds(5001));
  EXPECT_EQ(pacer.late_steps(), 0);
  EXPECT_EQ(pacer.dropped_time(), 0.0);
}

TEST(Pacer, SkipTo_ForgetsWhatWasDueWithoutCounting) {
  Pacer pacer(1000.0, kStart);
  pacer.skip_to(kStart + milliseconds(5000));
  EXPECT_EQ(pacer.deadline(), kStart + milliseconds(5000));
  pacer.skip_to(kStart);
  EXPECT_EQ(pacer.deadline(), kStart + milliseconds(5000));
  EXPECT_EQ(pacer.late_steps(), 0);
  EXPECT_EQ(pacer.dropped_time(), 0.0);
}

}  // namespace
}  // namespace layfigure::app
