#include <gtest/gtest.h>

#include "pinch.h"

namespace layfigure::haptics {
namespace {

constexpr double kTenMinutes = 600.0;  // [s]
constexpr double kMostDrift = 1e-4;    // [m]

TEST(PinchHold, TenMinutesInStillHands_DoesNotDrift) { EXPECT_LE(pinch_drift(kTenMinutes, 0.0, 0.0), kMostDrift); }

TEST(PinchHold, TenMinutesInTremblingHands_DoesNotDrift) { EXPECT_LE(pinch_drift(kTenMinutes, 0.0, 3e-4), kMostDrift); }

TEST(PinchHold, TenMinutesByTorsionToo_DoesNotDrift) { EXPECT_LE(pinch_drift(kTenMinutes, 0.005, 1e-4), kMostDrift); }

}  // namespace
}  // namespace layfigure::haptics
