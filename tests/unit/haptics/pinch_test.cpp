#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "pinch.h"
#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

constexpr double kGravity = 9.81;
const Eigen::Vector3d kMiddle(0, 0, 1);
const double kMu = std::sqrt(kFingertipFriction * 0.5);  // with a shape of friction 0.5
constexpr double kCone = 0.02;                           // what the slip threshold may be off by

TEST(Pinch, HeldByFriction_CarriesTheLimb) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle);
  pinch.glide_to(0.01, 20);
  run(hands, 2000);
  EXPECT_NEAR(pinch.pressure(0), 0.01 * kPinchStiffness, 0.01);
  EXPECT_NEAR(pinch.pressure(1), pinch.pressure(0), 1e-6);
  for (const int id : {0, 1}) {
    const Pointer& pointer = hands.pointers().at(id);
    EXPECT_TRUE(pointer.fingertip()->touched.contact);
    EXPECT_EQ(pointer.fingertip()->touched.body, 0);
    // Its own weight it does not feel: each carries half of the limb's.
    EXPECT_NEAR(pointer.grip()->force.force.z(), 0.5 * testing::kLimbMass * kGravity, 1e-3);
    EXPECT_NEAR(pointer.fingertip()->touched.force.z(), -0.5 * testing::kLimbMass * kGravity, 1e-3);
  }
}

TEST(Pinch, Lifted_TakesTheLimbAlong) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle);
  pinch.glide_to(0.01, 20);
  run(hands, 500);
  const Eigen::Vector3d before = fingertip_in_body(hands, 0, 0);
  pinch.glide_to(0.01, 1000, {0.05, 0.02, 0.2});
  run(hands, 2000);
  EXPECT_NEAR(hands.state().bodies[0].position.z(), 1.2, 0.005);
  EXPECT_NEAR(hands.state().bodies[0].position.x(), 0.05, 0.002);
  EXPECT_LT((fingertip_in_body(hands, 0, 0) - before).norm(), 1e-4);
}

TEST(Pinch, OpenedSlowly_SlipsAtTheCone) {
  for (const double friction : {0.5, 1.0, 2.0}) {
    const double expected = slip_pressure(friction);
    EXPECT_NEAR(pressure_at_slip(friction), expected, kCone * expected) << friction;
  }
}

/// By how much the limb has turned about the line between the fingers after two seconds, its com off by so much.
double turn_of(double off_center, double squeeze) {
  Hands hands(testing::pinched_limb(off_center), kStep);
  Pinch pinch(hands, kMiddle);
  pinch.glide_to(squeeze, 20);
  run(hands, 2000);
  return hands.state().bodies[0].rotation.angularDistance(Eigen::Quaterniond::Identity());
}

TEST(Pinch, OffCenter_IsHeldByTheTorsionOfThePads) {
  constexpr double kSqueeze = 0.01;
  const double pressure = kSqueeze * kPinchStiffness;
  const double radius = kPadShare * kFingertipRadius;
  const double most = 2.0 * kMu * pressure * radius / (testing::kLimbMass * kGravity);  // without a weight to carry
  EXPECT_LT(turn_of(0.5 * most, kSqueeze), 0.02);
  EXPECT_GT(turn_of(1.05 * most, kSqueeze), 0.2);
}

TEST(Pinch, HandsThatTremble_DoNotLetItCreep) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle);
  pinch.glide_to(0.01, 20);
  run(hands, 1000);
  const Eigen::Vector3d before = fingertip_in_body(hands, 0, 0);
  int moving = 0;
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    // A hand's tremor: a few tenths of a millimetre at 8 to 12 Hz.
    pinch.glide_to(0.01 + 2e-4 * std::sin(70.0 * t), 10,
                   3e-4 * Eigen::Vector3d(std::sin(55.0 * t), 0, std::cos(63.0 * t)));
    run(hands, 10);
    moving += hands.state().rest.resting ? 0 : 1;
  }
  EXPECT_EQ(moving, 1000);
  pinch.glide_to(0.01, 10);
  run(hands, 1000);
  EXPECT_LT((fingertip_in_body(hands, 0, 0) - before).norm(), 1e-6);
}

TEST(Pinch, HandsThatTurnAboutThePinchsAxis_DoNotLetItCreep) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle);
  constexpr double kSqueeze = 0.01;
  constexpr double kTurn = 0.35;       // [rad], once a second
  constexpr double kMostCreep = 1e-5;  // [m] in four seconds
  pinch.glide_to(kSqueeze, 20);
  run(hands, 1000);
  const double away = testing::kLimbRadius + kFingertipRadius - kSqueeze;
  const auto turn_once = [&] {
    for (int k = 1; k <= 100; ++k) {
      const double angle = kTurn * std::sin(2.0 * std::numbers::pi * k / 100.0);
      const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
      for (const int id : {0, 1}) {
        const double side = id == 0 ? 1.0 : -1.0;
        hands.receive(id, {.position = kMiddle + side * away * Eigen::Vector3d::UnitY(), .rotation = rotation});
      }
      hands.glide(10);
      run(hands, 10);
    }
  };
  turn_once();  // the pads settle
  const Eigen::Vector3d before = fingertip_in_body(hands, 0, 0);
  for (int second = 0; second < 4; ++second) turn_once();
  EXPECT_LT((fingertip_in_body(hands, 0, 0) - before).norm(), kMostCreep);
}

TEST(Pinch, HandsThatTiltInCircles_KeepWhatTheyHold) {
  constexpr int kCircles = 10;
  constexpr double kTilt = 0.35;      // [rad]
  constexpr double kMostWay = 1e-3;   // [m]
  constexpr double kMostTurn = 0.05;  // [rad]; without a slip, a ball that rolls in circles turns what it holds by 4
  for (const Tilting how : {Tilting::kInPlace, Tilting::kAboutTheMiddle}) {
    for (const double off_center : {0.0, 0.004}) {
      const TiltDrift drift = drift_by_tilting(how, kCircles, kTilt, off_center);
      EXPECT_LT(drift.way, kMostWay) << static_cast<int>(how) << " " << off_center;
      EXPECT_LT(drift.turn, kMostTurn) << static_cast<int>(how) << " " << off_center;
    }
  }
}

TEST(Pinch, LeftAlone_RestsAndDoesNotMove) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle);
  pinch.glide_to(0.01, 20);
  run(hands, 1000);
  ASSERT_TRUE(hands.state().rest.resting);
  const Eigen::Vector3d before = hands.state().bodies[0].position;
  run(hands, 5000);
  EXPECT_EQ(hands.state().bodies[0].position, before);
}

TEST(Pinch, SameCalls_SameBits) {
  const auto play = [] {
    Hands hands(testing::thick_doll(), kStep);
    Pinch pinch(hands, {0.5, 0, 1});
    pinch.glide_to(0.01, 100);
    run(hands, 200);
    pinch.glide_to(0.01, 300, {0, 0.02, 0.1});
    run(hands, 500);
    return hands.state();
  };
  const dynamics::State first = play();
  const dynamics::State second = play();
  for (std::size_t i = 0; i < first.bodies.size(); ++i) {
    EXPECT_EQ(first.bodies[i].rotation.coeffs(), second.bodies[i].rotation.coeffs());
    EXPECT_EQ(first.bodies[i].position, second.bodies[i].position);
    EXPECT_EQ(first.bodies[i].linear_momentum, second.bodies[i].linear_momentum);
  }
}

TEST(Pinch, ArmOfADoll_IsLiftedPastItsYield) {
  Hands hands(testing::thick_doll(), kStep);
  run(hands, 2000);
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(hands.model(), hands.state(), poses);
  Pinch pinch(hands, poses[2].com);
  pinch.glide_to(0.03, 300);
  run(hands, 500);
  pinch.glide_to(0.03, 1500, {-0.03, 0, 0.12});
  int yielding = 0;
  for (int k = 0; k < 2500; ++k) yielding = std::max(yielding, hands.step().yielding);
  EXPECT_GT(yielding, 0);
  for (const int id : {0, 1}) hands.release(id);
  run(hands, 3000);
  dynamics::world_poses(hands.model(), hands.state(), poses);
  EXPECT_GT(poses[2].com.z(), 1.03) << "it stays up";
}

}  // namespace
}  // namespace layfigure::haptics
