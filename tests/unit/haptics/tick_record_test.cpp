#include "layfigure/haptics/tick_record.h"

#include <gtest/gtest.h>

namespace layfigure::haptics {
namespace {

constexpr double kBinWidth = 0.19;  // of a duration: a quarter of an octave

TEST(TickWindow, TicksOfOneLength_AreToldWithTheirRate) {
  TickRecord record;
  TickWindow window;
  constexpr double kRate = 4000.0;
  for (int k = 0; k < 8000; ++k) {
    window.update(record, k / kRate);
    record.add(5e-6, 1);
  }
  const TickSummary summary = window.summary();
  EXPECT_NEAR(summary.rate_hz, kRate, 1e-6 * kRate);
  for (const double told : {summary.us_p50, summary.us_p99, summary.us_max}) {
    EXPECT_GE(told, 5.0);
    EXPECT_LE(told, 5.0 * (1.0 + kBinWidth));
  }
}

TEST(TickWindow, OneSlowTickInAHundred_IsTheLargestOnly) {
  TickRecord record;
  TickWindow window;
  window.update(record, 0.0);
  for (int k = 0; k < 1000; ++k) record.add(k % 200 == 0 ? 1e-3 : 2e-6, 1);
  window.update(record, 1.0);
  const TickSummary summary = window.summary();
  EXPECT_LT(summary.us_p99, 3.0);
  EXPECT_GE(summary.us_max, 1000.0);
}

TEST(TickWindow, LongAgo_IsForgotten) {
  TickRecord record;
  TickWindow window;
  window.update(record, 0.0);
  record.add(1.0, 1);  // longer than any bin
  for (int second = 1; second < 5; ++second) {
    window.update(record, second);
    record.add(2e-6, 1);
  }
  window.update(record, 5.0);
  EXPECT_LT(window.summary().us_max, 3.0);
  EXPECT_EQ(window.whole().ticks, 5);
}

TEST(TickRecord, LateTick_CountsWhatItMissed) {
  TickRecord record;
  record.add(1e-6, 1);
  record.add(1e-6, 4);
  EXPECT_EQ(record.ticks, 2);
  EXPECT_EQ(record.late, 1);
  EXPECT_EQ(record.missed, 3);
}

TEST(TickWindow, WithoutTicks_TellsNothing) {
  TickWindow window;
  EXPECT_EQ(window.summary().rate_hz, 0.0);
  window.update({}, 1.0);
  EXPECT_EQ(window.summary().us_max, 0.0);
}

}  // namespace
}  // namespace layfigure::haptics
