#include "layfigure/spidar/simulated_device.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "devices.h"
#include "layfigure/spidar/pose_solver.h"
#include "layfigure/spidar/tension_solver.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;

constexpr double kTick = 1e-3;  // [s]
constexpr double kReference = 2.0;

SimulatedParts frictionless() {
  SimulatedParts parts;
  parts.friction = 0.0;
  return parts;
}

/// Exerts a wrench at the grip's true pose for so many ticks, the hand wanting to be at `wanted`.
void hold(SimulatedSpidar& device, const Wrench& wrench, const Pose& wanted, int ticks) {
  const TensionSolver solver(device.geometry(), kReference);
  for (int k = 0; k < ticks; ++k) {
    device.command(solver.solve(device.grip(), wrench).tensions);
    device.advance(kTick, wanted);
  }
}

TEST(SimulatedSpidar, ConstantForce_BendsTheArmAndTheSkin) {
  const HandModel hand;
  SimulatedSpidar device(test::device("g6x3"), frictionless());
  Wrench wrench = Wrench::Zero();
  wrench.head<3>() = Vector3d(1.0, 0.5, -0.5);
  hold(device, wrench, {}, 5000);
  const Vector3d expected = wrench.head<3>() * (1.0 / hand.arm_stiffness + 1.0 / hand.grip_stiffness);
  EXPECT_LT((device.grip().position - expected).norm(), 1e-6);
  EXPECT_LT((device.felt().head<3>() - wrench.head<3>()).norm(), 1e-4);
  EXPECT_LT(device.felt().tail<3>().norm(), 1e-6);
}

TEST(SimulatedSpidar, HandThatMoves_TakesTheGripAlong) {
  SimulatedSpidar device(test::device("g6x4"), frictionless());
  const Pose wanted{.rotation = math::exp_rotation({0.2, -0.1, 0.3}), .position = {0.01, 0.02, -0.01}};
  hold(device, Wrench::Zero(), wanted, 3000);
  EXPECT_LT((device.grip().position - wanted.position).norm(), 1e-4);
  EXPECT_LT(device.grip().rotation.angularDistance(wanted.rotation), 1e-3);
}

TEST(SimulatedSpidar, Encoders_TellWhatWasATickAgoToACount) {
  SimulatedSpidar device(test::device("g6x5"));
  Pose wanted;
  for (int k = 0; k < 200; ++k) {
    const Lengths before = string_lengths(device.geometry(), device.grip());
    wanted.position.x() = 1e-4 * k;
    device.command(Tensions::Constant(kReference));
    device.advance(kTick, wanted);
    ASSERT_TRUE(device.read());
    EXPECT_LE((*device.read() - before).cwiseAbs().maxCoeff(), 0.5 * device.geometry().metres_per_count + 1e-12);
  }
  EXPECT_GT(device.grip().position.x(), 1e-3);
}

/// At 1 kHz, the strings at the reference: the pose from the lengths beside the truth of the instant that they tell of,
/// one tick ago, in units of what the rounding of the encoders leaves of it at best.
TEST(SimulatedSpidar, FastHand_PoseAtTheEncodersFloor) {
  SimulatedSpidar device(test::device("g6x3"));
  PoseSolver solver(device.geometry());
  device.command(Tensions::Constant(kReference));
  const auto hand_at = [](double time) {
    const double phase = 2.0 * std::numbers::pi * 2.0 * time;
    return Pose{.rotation = math::exp_rotation(Vector3d(0.5 * std::sin(phase), 0.25 * std::cos(0.7 * phase), 0.3)),
                .position = 0.04 * Vector3d(std::sin(phase), std::cos(1.1 * phase), 0.5 * std::sin(0.9 * phase))};
  };
  double position = 0.0, turn = 0.0, position_floor = 0.0, turn_floor = 0.0, fastest = 0.0;
  for (int tick = 0; tick < 4000; ++tick) {
    const Pose truth = device.grip();
    device.advance(kTick, hand_at(kTick * tick));
    fastest = std::max(fastest, (device.grip().position - truth.position).norm() / kTick);
    const PoseEstimate estimate = solver.solve(*device.read());
    ASSERT_TRUE(estimate.converged && !estimate.suspicious) << tick;
    const auto covariance = pose_covariance(device.geometry(), truth);
    position += (estimate.pose.position - truth.position).squaredNorm();
    turn += std::pow(estimate.pose.rotation.angularDistance(truth.rotation), 2);
    position_floor += covariance.topLeftCorner<3, 3>().trace();
    turn_floor += covariance.bottomRightCorner<3, 3>().trace();
  }
  EXPECT_GT(fastest, 0.2) << "a fast hand";
  EXPECT_LT(std::sqrt(position / position_floor), 1.2);
  EXPECT_LT(std::sqrt(turn / turn_floor), 1.2);
  RecordProperty("position_over_floor", std::to_string(std::sqrt(position / position_floor)));
  RecordProperty("turn_over_floor", std::to_string(std::sqrt(turn / turn_floor)));
}

TEST(SimulatedSpidar, Tensions_ComeWithTheMotorsLag) {
  SimulatedParts parts = frictionless();
  parts.motor_lag = 5e-3;
  SimulatedSpidar device(test::device("g6x3"), parts);
  const double start = device.pulls()[0];
  device.command(Tensions::Constant(5.0));
  for (int k = 0; k < 5; ++k) device.advance(kTick, {});
  EXPECT_NEAR(device.pulls()[0], 5.0 + (start - 5.0) * std::exp(-1.0), 0.02);
}

TEST(SimulatedSpidar, BrokenString_PullsNoMoreAndIsNoticed) {
  SimulatedSpidar device(test::device("g6x3"));
  PoseSolver solver(device.geometry());
  device.command(Tensions::Constant(kReference));
  for (int k = 0; k < 100; ++k) device.advance(kTick, {});
  ASSERT_TRUE(solver.solve(*device.read()).converged);
  device.faults().broken_string = 3;
  bool noticed = false;
  for (int k = 0; k < 10 && !noticed; ++k) {
    device.advance(kTick, {});
    const PoseEstimate estimate = solver.solve(*device.read());
    noticed = estimate.suspicious && estimate.suspect == 3;
  }
  EXPECT_TRUE(noticed) << "within 10 ms";
  EXPECT_EQ(device.pulls()[3], 0.0);
}

TEST(SimulatedSpidar, StuckEncoder_TellsTheSameLength) {
  SimulatedSpidar device(test::device("g6x3"));
  device.faults().stuck_encoder = 5;
  device.command(Tensions::Constant(kReference));
  device.advance(kTick, {});
  const double stuck = (*device.read())[5];
  for (int k = 0; k < 500; ++k) device.advance(kTick, {.position = {0.02, 0.0, 0.0}});
  EXPECT_EQ((*device.read())[5], stuck);
  EXPECT_GT(std::abs(string_lengths(device.geometry(), device.grip())[5] - stuck), 1e-3);
}

TEST(SimulatedSpidar, Silent_TellsNothingAndLetsGoWithinTenMilliseconds) {
  SimulatedSpidar device(test::device("g6x3"));
  device.command(Tensions::Constant(10.0));
  for (int k = 0; k < 50; ++k) device.advance(kTick, {});
  EXPECT_GT(device.pulls().minCoeff(), 9.0);
  device.faults().silent = true;
  device.command(Tensions::Constant(20.0));
  for (int k = 0; k < 10; ++k) device.advance(kTick, {});
  EXPECT_FALSE(device.read());
  EXPECT_LT(device.pulls().maxCoeff(), 0.1);
}

TEST(SimulatedSpidar, StringTakenInTooSlowly_IsSlackAndTooLong) {
  SimulatedParts parts;
  parts.reel_speed = 0.01;
  SimulatedSpidar device(test::device("g6x3"), parts);
  device.command(Tensions::Constant(device.geometry().least_tension));
  for (int k = 0; k < 100; ++k) device.advance(kTick, {.position = {0.03, 0.0, 0.0}});
  const Lengths way = string_lengths(device.geometry(), device.grip());
  int slack = 0;
  for (int i = 0; i < kStrings; ++i) {
    if ((*device.read())[i] - way[i] < 1e-3) continue;
    ++slack;
    EXPECT_EQ(device.pulls()[i], 0.0);
  }
  EXPECT_GE(slack, 2) << "those towards the side that the hand goes to";
}

TEST(SimulatedSpidar, TensionsThatAreNotFinite_CountAsTheLeast) {
  SimulatedSpidar device(test::device("g6x3"), frictionless());
  device.command(Tensions::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (int k = 0; k < 50; ++k) device.advance(kTick, {});
  EXPECT_NEAR(device.pulls().maxCoeff(), device.geometry().least_tension, 1e-9);
}

TEST(SimulatedSpidar, BadParts_Refused) {
  SimulatedParts parts;
  parts.grip_mass = 0.0;
  EXPECT_THROW(SimulatedSpidar(test::device("g6x3"), parts), GeometryError);
  parts = {};
  parts.hand.mass = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(SimulatedSpidar(test::device("g6x3"), parts), GeometryError);
}

}  // namespace
}  // namespace layfigure::spidar
