#include "layfigure/haptics/soft_tip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using math::exp_rotation;
using math::log_rotation;

constexpr double kStiffness = 2.5;  // [N m/rad]
constexpr double kDamping = 0.03;   // [N m s/rad]
constexpr double kRounding = 1e-12;

class Dice {
 public:
  Vector3d vector(double size) { return size * Vector3d(normal_(random_), normal_(random_), normal_(random_)); }
  Vector3d direction() { return vector(1.0).normalized(); }
  Quaterniond rotation(double size) { return exp_rotation(vector(size)); }

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
};

TEST(TwistAbout, TurnAboutTheAxisAndATiltAfterIt_IsTheTurn) {
  Dice dice;
  for (int k = 0; k < 100; ++k) {
    const Vector3d axis = dice.direction();
    const Vector3d across = axis.cross(dice.direction()).normalized();
    for (const double angle : {-2.9, -0.3, 0.0, 1e-9, 0.7, 3.1}) {
      for (const double tilt : {0.0, 0.4, 2.0}) {
        const Twist twist = twist_about(exp_rotation(tilt * across) * exp_rotation(angle * axis), axis);
        EXPECT_NEAR(twist.angle, angle, kRounding);
        EXPECT_NEAR(twist.share, std::cos(0.5 * tilt), kRounding);
      }
    }
  }
}

TEST(TwistAbout, Gradient_IsTheDifferenceThatATurnMakes) {
  constexpr double kStep = 1e-6;
  Dice dice;
  for (int k = 0; k < 200; ++k) {
    const Vector3d axis = dice.direction();
    const Quaterniond rotation = dice.rotation(0.6);
    const Twist twist = twist_about(rotation, axis);
    if (twist.share < 0.5) continue;
    const Vector3d way = dice.direction();
    const double ahead = twist_about(exp_rotation(kStep * way) * rotation, axis).angle;
    const double behind = twist_about(exp_rotation(-kStep * way) * rotation, axis).angle;
    EXPECT_NEAR(twist.gradient.dot(way), std::remainder(ahead - behind, 2.0 * std::numbers::pi) / (2.0 * kStep), 1e-8);
  }
}

TEST(TwistAbout, HalfATurnAcrossTheAxis_HasNone) {
  const Twist twist = twist_about(Quaterniond(0.0, 1.0, 0.0, 0.0), Vector3d::UnitZ());
  EXPECT_EQ(twist.angle, 0.0);
  EXPECT_EQ(twist.share, 0.0);
  EXPECT_TRUE(twist.gradient.allFinite());
}

const TipMotion kPressed{
    .rotation = Quaterniond::Identity(), .angular_velocity = Vector3d::Zero(), .normal = Vector3d::UnitZ()};

SoftTip::Target follow(SoftTip& soft, const Quaterniond& wanted, const TipMotion& tip,
                       const Vector3d& rate = Vector3d::Zero()) {
  return soft.follow(wanted, rate, tip, kStiffness, kDamping);
}

TEST(SoftTip, OffWhatItTouches_TurnsWithTheHand) {
  SoftTip soft;
  Dice dice;
  for (int k = 0; k < 10; ++k) {
    const Quaterniond wanted = dice.rotation(1.0);
    const Vector3d rate = dice.vector(1.0);
    const SoftTip::Target target = follow(soft, wanted, {.rotation = dice.rotation(1.0)}, rate);
    EXPECT_EQ(target.rotation.coeffs(), wanted.coeffs());
    EXPECT_EQ(target.angular_velocity, rate);
    EXPECT_EQ(soft.of_hand(rate), rate);
  }
}

TEST(SoftTip, Pressed_TwistsWithTheHandAndDoesNotTilt) {
  SoftTip soft;
  (void)follow(soft, Quaterniond::Identity(), kPressed);
  const SoftTip::Target tilted = follow(soft, exp_rotation({0.3, -0.2, 0.0}), kPressed, {1.0, 0.0, 0.0});
  EXPECT_LT(log_rotation(tilted.rotation).norm(), kRounding);
  EXPECT_NEAR(tilted.angular_velocity.head<2>().norm(), 0.0, kRounding);
  const SoftTip::Target twisted = follow(soft, exp_rotation({0.0, 0.0, 0.3}), kPressed, {0.0, 0.0, 2.0});
  EXPECT_LT((log_rotation(twisted.rotation) - Vector3d(0.0, 0.0, 0.3)).norm(), kRounding);
  EXPECT_LT((twisted.angular_velocity - Vector3d(0.0, 0.0, 2.0)).norm(), kRounding);
}

TEST(SoftTip, HandThatTiltsInCircles_ComesBackToTheSameTarget) {
  SoftTip soft;
  (void)follow(soft, exp_rotation({0.0, 0.0, 0.1}), kPressed);
  for (int k = 0; k <= 1000; ++k) {
    const double phase = 2.0 * std::numbers::pi * k / 100.0;
    (void)follow(soft, exp_rotation(0.4 * Vector3d(std::cos(phase), std::sin(phase), 0.0)), kPressed);
  }
  const SoftTip::Target target = follow(soft, exp_rotation({0.0, 0.0, 0.1}), kPressed);
  EXPECT_LT((log_rotation(target.rotation) - Vector3d(0.0, 0.0, 0.1)).norm(), kRounding);
}

TEST(SoftTip, PowerOfTheHand_IsWhatTheTargetGetsOfIt) {
  constexpr double kStep = 1e-6;
  Dice dice;
  for (int k = 0; k < 100; ++k) {
    SoftTip soft;
    (void)follow(soft, Quaterniond::Identity(), kPressed);
    const Quaterniond wanted = dice.rotation(0.3);
    const Vector3d rate = dice.direction();
    const Quaterniond before = follow(soft, exp_rotation(-kStep * rate) * wanted, kPressed).rotation;
    const Quaterniond after = follow(soft, exp_rotation(kStep * rate) * wanted, kPressed).rotation;
    const SoftTip::Target target = follow(soft, wanted, kPressed, rate);
    const Vector3d spin = log_rotation(after * before.conjugate()) / (2.0 * kStep);
    EXPECT_LT((spin - target.angular_velocity).norm(), 1e-8);
    const Vector3d torque = dice.vector(1.0);
    EXPECT_NEAR(soft.of_hand(torque).dot(rate), torque.dot(target.angular_velocity), kRounding);
  }
}

TEST(SoftTip, FingertipThatIsTilted_TakesItsTargetAlong) {
  SoftTip soft;
  (void)follow(soft, Quaterniond::Identity(), kPressed);
  TipMotion tip = kPressed;
  tip.rotation = exp_rotation({0.5 * kGivingWay, 0.0, 0.0});
  EXPECT_LT(log_rotation(follow(soft, Quaterniond::Identity(), tip).rotation).norm(), kRounding) << "it is held";
  tip.rotation = exp_rotation({0.1, 0.0, 0.0});
  tip.normal = tip.rotation * Vector3d::UnitZ();
  tip.angular_velocity = {2.0, 0.0, 0.0};
  const SoftTip::Target target = follow(soft, Quaterniond::Identity(), tip);
  EXPECT_LT(log_rotation(target.rotation * tip.rotation.conjugate()).norm(), 1e-6) << "and then it is not";
  EXPECT_LT((target.angular_velocity - tip.angular_velocity).norm(), kRounding) << "nor is it braked";
}

TEST(SoftTip, TakenOff_NothingJumps) {
  SoftTip soft;
  (void)follow(soft, Quaterniond::Identity(), kPressed);
  const Quaterniond wanted = exp_rotation({0.3, 0.1, 0.2});
  const Quaterniond before = follow(soft, wanted, kPressed).rotation;
  TipMotion off = kPressed;
  off.normal.setZero();
  EXPECT_LT(log_rotation(follow(soft, wanted, off).rotation * before.conjugate()).norm(), kRounding);
  const Quaterniond turn = exp_rotation({-0.2, 0.5, 0.1});
  EXPECT_LT(log_rotation(follow(soft, turn * wanted, off).rotation * (turn * before).conjugate()).norm(), kRounding)
      << "and it turns with the hand";
}

TEST(SoftTip, TiltedRightRound_StaysBounded) {
  SoftTip soft;
  (void)follow(soft, Quaterniond::Identity(), kPressed);
  Quaterniond last = Quaterniond::Identity();
  for (int k = 1; k <= 2000; ++k) {
    const Quaterniond wanted = exp_rotation({0.01 * k, 0.0, 0.0}) * exp_rotation({0.0, 0.003 * k, 0.0});
    const SoftTip::Target target = follow(soft, wanted, kPressed, {10.0, 0.0, 0.0});
    EXPECT_LT(log_rotation(target.rotation * last.conjugate()).norm(), 0.05) << k;
    EXPECT_LT(target.angular_velocity.norm(), 2.0 * 10.0 + kRounding) << k;
    last = target.rotation;
  }
}

/// Energy of the coupling's spring.
double stored(const Quaterniond& target, const Quaterniond& tip) {
  return 0.5 * kStiffness * log_rotation(target * tip.conjugate()).squaredNorm();
}

TEST(SoftTip, WhateverTheFingertipDoes_TheSpringGetsNothingButFromTheHandAndIt) {
  Dice dice;
  SoftTip soft;
  TipMotion tip = kPressed;
  Quaterniond wanted = Quaterniond::Identity();
  Quaterniond target = follow(soft, wanted, tip).rotation;
  double made = 0.0;
  for (int k = 0; k < 20'000; ++k) {
    // The fingertip moves: what that does to the spring is its work. Then only its normal, the hand standing still.
    if (k % 3 == 0) tip.rotation = dice.rotation(3e-3) * tip.rotation;
    if (k % 7 == 0) tip.normal = (tip.normal + dice.vector(0.1)).normalized();
    if (k % 100 == 0) tip.normal.setZero();
    if (k % 100 == 20) tip.normal = dice.direction();
    tip.angular_velocity = dice.vector(0.1);
    const double before = stored(target, tip.rotation);
    const double after = stored(follow(soft, wanted, tip).rotation, tip.rotation);
    made += after - before;
    ASSERT_LE(made, 1e-9) << k;
    wanted = dice.rotation(0.02) * wanted;
    target = follow(soft, wanted, tip).rotation;
    ASSERT_NEAR(target.norm(), 1.0, kRounding);
  }
}

}  // namespace
}  // namespace layfigure::haptics
