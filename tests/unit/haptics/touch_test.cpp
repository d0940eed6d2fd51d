#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

#include "pinch.h"
#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

constexpr int kDollBodies = 3;

constexpr double kOverlap = 2e-5;  // [m] by which what turns may overlap in a step

/// From the fingertip of pointer 0 to the segment along the arm.
double distance_to_arm(const Hands& hands) {
  Eigen::Vector3d p = fingertip_in_body(hands, 0, 2) - Eigen::Vector3d(0.1, 0, 0);
  p.x() -= std::clamp(p.x(), -0.06, 0.06);
  return p.norm();
}

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

void expect_same_bits(const dynamics::State& a, const dynamics::State& b) {
  for (int i = 0; i < kDollBodies; ++i) {
    EXPECT_EQ(a.bodies[i].rotation.coeffs(), b.bodies[i].rotation.coeffs()) << i;
    EXPECT_EQ(a.bodies[i].rest_rotation.coeffs(), b.bodies[i].rest_rotation.coeffs()) << i;
    EXPECT_EQ(a.bodies[i].linear_momentum, b.bodies[i].linear_momentum) << i;
    EXPECT_EQ(a.bodies[i].angular_momentum, b.bodies[i].angular_momentum) << i;
    EXPECT_EQ(a.bodies[i].trial_torque, b.bodies[i].trial_torque) << i;
    EXPECT_EQ(a.bodies[i].torque, b.bodies[i].torque) << i;
    EXPECT_EQ(a.bodies[i].position, b.bodies[i].position) << i;
    EXPECT_EQ(a.bodies[i].flow, b.bodies[i].flow) << i;
    EXPECT_EQ(a.bodies[i].yield_scale, b.bodies[i].yield_scale) << i;
    EXPECT_EQ(a.bodies[i].rest_time, b.bodies[i].rest_time) << i;
    EXPECT_EQ(a.bodies[i].asleep, b.bodies[i].asleep) << i;
    EXPECT_EQ(a.bodies[i].yielding, b.bodies[i].yielding) << i;
  }
  EXPECT_EQ(a.time, b.time);
}

TEST(Touch, ToolThatComesOrGoes_LeavesTheDollBitForBit) {
  Hands hands(testing::thick_doll(), kStep);
  const Eigen::Vector3d held = hands.grab({.pointer = 5, .bone = 2});
  hands.receive(5, at(held));
  hands.receive(5, at(held + Eigen::Vector3d(0, 0, 0.1)));
  hands.glide(5, 100);
  run(hands, 60);  // in the middle of a motion
  for (const int id : {0, 3, 1}) {
    const dynamics::State before = hands.state();
    hands.receive(id, at({0.1 * id, 0.5, 1}));
    hands.touch({.pointer = id});
    expect_same_bits(before, hands.state());
    EXPECT_EQ(hands.state().bodies.size(), before.bodies.size() + 1);
  }
  run(hands, 10);
  for (const int id : {3, 0, 1}) {
    const dynamics::State before = hands.state();
    hands.release(id);
    expect_same_bits(before, hands.state());
  }
  EXPECT_EQ(hands.model().size(), kDollBodies);
}

TEST(Touch, FarFromTheDoll_ChangesNothingOfIt) {
  Hands touched(testing::thick_doll(), kStep);
  Hands alone(testing::thick_doll(), kStep);
  touched.receive(0, at({0, 3, 1}));
  touched.touch({.pointer = 0});
  run(touched, 500);
  run(alone, 500);
  expect_same_bits(touched.state(), alone.state());
}

TEST(Touch, OtherFingertipsStay_WhenOneGoes) {
  Hands hands(testing::thick_doll(), kStep);
  for (const int id : {0, 1, 2}) {
    hands.receive(id, at({0.1 * id, 0.5, 1}));
    hands.touch({.pointer = id});
  }
  hands.receive(2, at({0.2, 0.5, 1.5}));
  hands.glide(2, 100);
  run(hands, 50);
  const dynamics::BodyState before = hands.state().bodies[kDollBodies + 2];
  hands.release(0);
  EXPECT_EQ(hands.pointers().at(2).grip()->coupling.body, kDollBodies + 1);
  EXPECT_EQ(hands.state().bodies[kDollBodies + 1].position, before.position);
  EXPECT_EQ(hands.state().bodies[kDollBodies + 1].linear_momentum, before.linear_momentum);
  run(hands, 400);
  EXPECT_NEAR(hands.state().bodies[kDollBodies + 1].position.z(), 1.5, 1e-4);
}

TEST(Touch, InFreeAir_FollowsItsPointerWithoutForceOrWeight) {
  Hands hands(testing::thick_doll(), kStep);
  hands.receive(0, at({0, 1, 1}));
  hands.touch({.pointer = 0});
  run(hands, 100);
  EXPECT_LT(hands.pointers().at(0).grip()->force.force.norm(), 1e-9);
  EXPECT_LT((hands.state().bodies[kDollBodies].position - Eigen::Vector3d(0, 1, 1)).norm(), 1e-12);
  hands.receive(0, at({0.1, 1, 1}));
  hands.glide(0, 100);
  run(hands, 50);
  EXPECT_NEAR(hands.state().bodies[kDollBodies].position.x(), 0.05, 1e-3);
  run(hands, 300);
  EXPECT_NEAR(hands.state().bodies[kDollBodies].position.x(), 0.1, 1e-6);
  EXPECT_FALSE(hands.pointers().at(0).fingertip()->touched.contact);
}

TEST(Touch, PushedPastTheYield_LeavesTheArmWhereItIs) {
  Hands hands(testing::thick_doll(), kStep);
  run(hands, 2000);
  const auto tip = [&] {
    std::vector<dynamics::BodyPose> poses;
    dynamics::world_poses(hands.model(), hands.state(), poses);
    return poses[2].com;
  };
  const Eigen::Vector3d before = tip();
  const double side = testing::kLimbRadius + kFingertipRadius + 1e-3;
  const Eigen::Vector3d beside = before + Eigen::Vector3d(0.05, side, 0);
  hands.receive(0, at(beside));
  hands.touch({.pointer = 0, .stiffness = 2000.0});
  hands.receive(0, at(beside + Eigen::Vector3d(-0.02, -0.25, 0)));
  hands.glide(0, 1000);
  int yielding = 0;
  double hardest = 0.0;
  for (int k = 0; k < 1500; ++k) {
    const dynamics::StepReport report = hands.step();
    ASSERT_EQ(report.status, dynamics::StepStatus::kOk);
    yielding = std::max(yielding, report.yielding);
    hardest = std::max(hardest, hands.pointers().at(0).fingertip()->touched.force.norm());
    ASSERT_GT(distance_to_arm(hands), testing::kLimbRadius + kFingertipRadius - kOverlap) << k;
  }
  EXPECT_GT(yielding, 0);
  EXPECT_GT(hardest, 5.0);
  hands.release(0);
  run(hands, 4000);
  EXPECT_LT(tip().y(), before.y() - 0.05);
}

TEST(Touch, Fingertips_GoThroughEachOther) {
  Hands hands(testing::thick_doll(), kStep);
  for (const int id : {0, 1}) {
    hands.receive(id, at({0, id == 0 ? 0.5 : 0.6, 1}));
    hands.touch({.pointer = id});
  }
  hands.receive(0, at({0, 0.6, 1}));
  hands.receive(1, at({0, 0.5, 1}));
  hands.glide(200);
  for (int k = 0; k < 300; ++k) {
    run(hands, 1);
    ASSERT_FALSE(hands.pointers().at(0).fingertip()->touched.contact);
  }
  EXPECT_NEAR(hands.state().bodies[kDollBodies].position.y(), 0.6, 1e-3);
}

TEST(Touch, ThatCannotBe_RefusedAndNothingChanged) {
  Hands hands(testing::thick_doll(), kStep);
  EXPECT_NE(refusal([&] { hands.touch({.pointer = 0}); }).find("no pose yet"), std::string::npos);
  hands.receive(0, at({0.5, 0.01, 1}));
  EXPECT_NE(refusal([&] { hands.touch({.pointer = 0}); }).find("inside something"), std::string::npos);
  EXPECT_EQ(hands.model().size(), kDollBodies);
  EXPECT_EQ(hands.pointers().at(0).tool(), Tool::kNone);
  run(hands, 10);
  hands.receive(0, at({0.5, 0.5, 1}));
  hands.touch({.pointer = 0});
  EXPECT_NE(refusal([&] { hands.touch({.pointer = 0}); }).find("fingertip out already"), std::string::npos);
  EXPECT_NE(refusal([&] { hands.grab({.pointer = 0, .bone = 2}); }).find("fingertip out already"), std::string::npos);
  EXPECT_EQ(hands.model().size(), kDollBodies + 1);
}

TEST(Touch, PointerWhoseClientHasGone_StaysWhereItIs) {
  Hands hands(testing::pinched_limb(), kStep);
  Pinch pinch(hands, {0, 0, 1});
  pinch.glide_to(0.01, 20);
  run(hands, 30000);  // half a minute without any message
  EXPECT_EQ(hands.pointers().at(0).tool(), Tool::kTouch);
  EXPECT_NEAR(hands.state().bodies[0].position.z(), 1.0, 0.01);
}

TEST(Touch, AfterReset_IsPutAway) {
  Hands hands(testing::thick_doll(), kStep);
  hands.receive(0, at({0.5, 0.5, 1}));
  hands.touch({.pointer = 0});
  hands.reset();
  EXPECT_EQ(hands.pointers().at(0).tool(), Tool::kNone);
  EXPECT_EQ(hands.model().size(), kDollBodies);
  run(hands, 10);
}

}  // namespace
}  // namespace layfigure::haptics
