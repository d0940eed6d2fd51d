#include "layfigure/app/pointer_input.h"

#include <gtest/gtest.h>

namespace layfigure::app {
namespace {

TEST(PointerInput, SteadyStream_IsItsInterval) {
  PointerInput pointer;
  for (int i = 1; i <= 20; ++i) pointer.receive("test", i, 16 * i, 50.0);
  EXPECT_NEAR(pointer.message_interval(), 16.0, 1e-4);
}

TEST(PointerInput, BurstInASteadyStream_HardlyShortensIt) {
  PointerInput pointer;
  for (int i = 1; i <= 20; ++i) pointer.receive("test", i, 16 * i, 50.0);
  pointer.receive("test", 21, 16 * 20, 50.0);
  EXPECT_GE(pointer.message_interval(), 8.0);
}

TEST(PointerInput, LongSilence_CountsAsTheLongest) {
  PointerInput pointer;
  pointer.receive("test", 1, 100000, 50.0);
  EXPECT_EQ(pointer.message_interval(), 50.0);
}

TEST(PointerInput, OlderOfTheSameClient_IsOld) {
  PointerInput pointer;
  pointer.receive("test", 5, 0, 50.0);
  EXPECT_TRUE(pointer.is_old("test", 5));
  EXPECT_TRUE(pointer.is_old("test", 4));
  EXPECT_FALSE(pointer.is_old("test", 6));
  EXPECT_FALSE(pointer.is_old("another", 1));
}

}  // namespace
}  // namespace layfigure::app
