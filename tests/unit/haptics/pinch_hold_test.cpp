#include <gtest/gtest.h>

#include <cmath>

#include "pinch.h"
#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

constexpr int kTenMinutes = 600 * 1000;  // [steps]
constexpr double kMostDrift = 1e-4;      // [m]

/// How far the fingertips have slid on the limb after ten minutes, in hands that tremble by so much [m]: these never
/// let the scene rest.
double drift_after_ten_minutes(double off_center, double tremor) {
  Hands hands(testing::pinched_limb(off_center), kStep);
  Pinch pinch(hands, {0, 0, 1});
  constexpr double kSqueeze = 0.01;
  pinch.glide_to(kSqueeze, 20);
  run(hands, 1000);
  const Eigen::Vector3d before[] = {fingertip_in_body(hands, 0, 0), fingertip_in_body(hands, 1, 0)};
  constexpr int kInterval = 10;  // [steps] between the hands' poses
  for (int k = 0; k < kTenMinutes / kInterval; ++k) {
    const double t = kInterval * kStep * k;
    const Eigen::Vector3d shift = tremor * Eigen::Vector3d(std::sin(55.0 * t), 0, std::cos(63.0 * t));
    pinch.glide_to(kSqueeze + tremor * std::sin(70.0 * t), kInterval, shift);
    run(hands, kInterval);
  }
  pinch.glide_to(kSqueeze, kInterval);
  run(hands, 1000);
  double drift = 0.0;
  for (const int id : {0, 1}) drift = std::max(drift, (fingertip_in_body(hands, id, 0) - before[id]).norm());
  ::testing::Test::RecordProperty("drift_nm", std::to_string(1e9 * drift));
  std::printf("tremor %.1f mm, com off by %.0f mm: drift %.3g mm in 10 min\n", 1e3 * tremor, 1e3 * off_center,
              1e3 * drift);
  return drift;
}

TEST(PinchHold, TenMinutesInStillHands_DoesNotDrift) { EXPECT_LE(drift_after_ten_minutes(0.0, 0.0), kMostDrift); }

TEST(PinchHold, TenMinutesInTremblingHands_DoesNotDrift) { EXPECT_LE(drift_after_ten_minutes(0.0, 3e-4), kMostDrift); }

TEST(PinchHold, TenMinutesByTorsionToo_DoesNotDrift) { EXPECT_LE(drift_after_ten_minutes(0.005, 1e-4), kMostDrift); }

}  // namespace
}  // namespace layfigure::haptics
