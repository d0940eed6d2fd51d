#include <gtest/gtest.h>

#include <stdexcept>

#include "pinch.h"
#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

const Eigen::Vector3d kMiddle(0, 0, 1);
constexpr FingertipDefinition kMagnet{.friction = 0.0, .magnet = true};

TEST(Magnet, WithoutFriction_HoldsWhatItTouchesWithOneFinger) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle, kMagnet);
  pinch.glide_to(0.002, 10);
  run(hands, 100);
  hands.release(1);
  run(hands, 2000);
  const Eigen::Vector3d before = fingertip_in_body(hands, 0, 0);
  EXPECT_NEAR(hands.pointers().at(0).grip()->force.force.z(), testing::kLimbMass * 9.81, 1e-2);
  EXPECT_EQ(hands.pointers().at(0).fingertip()->touched.body, 0);
  // Pulled away from, shaken and turned, it does not drop.
  pinch.aim(0, -0.2, {0.1, 0, 0.1});
  hands.glide(0, 100);
  run(hands, 1000);
  pinch.aim(0, 0.0);
  hands.glide(0, 50);
  run(hands, 5000);
  EXPECT_LT((fingertip_in_body(hands, 0, 0) - before).norm(), 1e-6);
}

TEST(Magnet, TurnedOff_LetsGo) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle, kMagnet);
  pinch.glide_to(0.002, 10);
  run(hands, 500);
  EXPECT_NEAR(hands.state().bodies[0].position.z(), 1.0, 0.02);
  for (const int id : {0, 1}) hands.set_magnet(id, false);
  run(hands, 200);
  EXPECT_LT(hands.state().bodies[0].position.z(), 0.9);
}

TEST(Magnet, TurnedOnWhileTouching_TakesHold) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle);
  pinch.glide_to(0.01, 20);
  run(hands, 200);
  hands.set_magnet(0, true);
  run(hands, 10);
  EXPECT_TRUE(hands.pointers().at(0).fingertip()->bond.has_value());
  pinch.glide_to(-0.05, 200);
  run(hands, 1000);
  EXPECT_GT(hands.state().bodies[0].position.z(), 0.9);
}

TEST(Magnet, OfAToolThatStays_HoldsWhenAnotherGoes) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, kMiddle, kMagnet);
  pinch.glide_to(0.002, 10);
  run(hands, 200);
  hands.release(0);  // the body of the other fingertip has another index now
  run(hands, 1000);
  EXPECT_GT(hands.state().bodies[0].position.z(), 0.9);
  EXPECT_TRUE(hands.pointers().at(1).fingertip()->touched.contact);
}

TEST(Magnet, WithoutFingertip_Refused) {
  Hands hands(testing::pinched_limb(), kStep);
  EXPECT_THROW(hands.set_magnet(0, true), std::invalid_argument);
  hands.grab({.bone = 0});
  EXPECT_THROW(hands.set_magnet(0, true), std::invalid_argument);
}

}  // namespace
}  // namespace layfigure::haptics
