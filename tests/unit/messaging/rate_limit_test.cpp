#include "layfigure/messaging/rate_limit.h"

#include <gtest/gtest.h>

namespace layfigure::messaging {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

const RateLimit::Clock::time_point kStart{std::chrono::hours(1)};

int take_all(RateLimit& limit, RateLimit::Clock::time_point now) {
  int taken = 0;
  while (limit.take(now)) ++taken;
  return taken;
}

TEST(RateLimit, AtOnce_TheBurst) {
  RateLimit limit(100.0, 7.0);
  EXPECT_EQ(take_all(limit, kStart), 7);
}

TEST(RateLimit, InTheLongRun_TheRate) {
  RateLimit limit(100.0, 7.0);
  int taken = 0;
  for (int i = 0; i <= 10'000; ++i) taken += take_all(limit, kStart + milliseconds(i));
  EXPECT_NEAR(taken, 7 + 1000, 1);
}

TEST(RateLimit, AfterALongRest_NoMoreThanTheBurst) {
  RateLimit limit(100.0, 7.0);
  take_all(limit, kStart);
  EXPECT_EQ(take_all(limit, kStart + std::chrono::hours(1)), 7);
}

TEST(RateLimit, ReadyAt_IsWhenTheNextIsTaken) {
  RateLimit limit(100.0, 1.0);
  EXPECT_EQ(limit.ready_at(kStart), kStart);
  EXPECT_TRUE(limit.take(kStart));
  const auto ready = limit.ready_at(kStart);
  EXPECT_NEAR(static_cast<double>((ready - kStart).count()), 1e7, 10.0);
  EXPECT_FALSE(limit.take(ready - nanoseconds(1000)));
  EXPECT_TRUE(limit.take(ready + nanoseconds(10)));
}

TEST(RateLimit, ClockThatStandsStill_GivesNothing) {
  RateLimit limit(1e6, 1.0);
  EXPECT_TRUE(limit.take(kStart));
  EXPECT_FALSE(limit.take(kStart));
  EXPECT_FALSE(limit.take(kStart - milliseconds(5)));
}

}  // namespace
}  // namespace layfigure::messaging
