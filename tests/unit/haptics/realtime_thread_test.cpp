#include "layfigure/haptics/realtime_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <stdexcept>

namespace layfigure::haptics {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;

TEST(TickTimes, OnTime_AreMultiplesOfThePeriod) {
  TickTimes times(1000.0, 5 * kMillisecond);
  for (int k = 0; k < 100; ++k) {
    EXPECT_EQ(times.due_ns(), (5 + k) * kMillisecond);
    // A delay below a period is none of the next tick's.
    EXPECT_EQ(times.begin(times.due_ns() + kMillisecond / 3), 0);
  }
  EXPECT_EQ(times.statistics().ticks, 100);
  EXPECT_EQ(times.statistics().late, 0);
  EXPECT_EQ(times.statistics().skipped, 0);
  EXPECT_NEAR(times.statistics().worst_delay, 1e-3 / 3.0, 1e-6);
}

TEST(TickTimes, LateTick_StandsForThoseThatItMissed) {
  TickTimes times(1000.0, 0);
  EXPECT_EQ(times.begin(0), 0);
  EXPECT_EQ(times.begin(4 * kMillisecond + kMillisecond / 2), 3);
  EXPECT_EQ(times.due_ns(), 5 * kMillisecond) << "back on the grid";
  EXPECT_EQ(times.statistics().late, 1);
  EXPECT_EQ(times.statistics().skipped, 3);
  EXPECT_NEAR(times.statistics().worst_delay, 3.5e-3, 1e-9);
}

TEST(TickTimes, BadRate_SaysTheValue) {
  for (const double rate : {0.0, -1.0, 1e6, std::nan("")}) {
    EXPECT_THROW(TickTimes(rate, 0), std::invalid_argument) << rate;
  }
}

TEST(RealtimeThread, Ticks_AccountForAllTheTimeThatPasses) {
  constexpr double kRate = 2000.0;
  std::atomic<int> ticks{0};
  std::atomic<double> time{0.0};
  TickStatistics told;
  {
    const RealtimeThread thread(kRate, [&](double h) {
      time.store(time.load() + h);
      ++ticks;
    });
    while (ticks < 50) std::this_thread::yield();
    told = thread.statistics();
    const RealtimeGrant& grant = thread.grant();
    EXPECT_EQ(grant.refused.empty(), grant.scheduled && grant.memory_locked) << grant.refused;
  }
  EXPECT_GE(told.ticks, 1);
  EXPECT_GE(time.load() * kRate, ticks - 1e-6) << "a tick stands for at least one period";
  const int at_end = ticks;
  std::this_thread::yield();
  EXPECT_EQ(ticks, at_end) << "the thread has ended";
}

}  // namespace
}  // namespace layfigure::haptics
