#include <gtest/gtest.h>

#include "allocation_count.h"
#include "pinch.h"
#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

TEST(HandsStep, InAPinchWithPins_DoesNotAllocate) {
  Hands hands(testing::thick_doll(), kStep);
  hands.pin({.bone = 1});
  hands.pin({.bone = 3, .rigid = true});
  Pinch pinch(hands, {0.5, 0, 1});
  pinch.glide_to(0.01, 50);
  run(hands, 200);  // as many contacts as there will be
  pinch.glide_to(0.012, 500, {0, 0, 0.02});
  const long before = testing::allocation_count();
  for (int k = 0; k < 500; ++k) ASSERT_EQ(hands.step().status, dynamics::StepStatus::kOk);
  EXPECT_EQ(testing::allocation_count(), before);
}

}  // namespace
}  // namespace layfigure::haptics
