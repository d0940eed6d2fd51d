#include "layfigure/spidar/pose_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "devices.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;

constexpr double kDegrees = std::numbers::pi / 180.0;

double position_error(const Pose& a, const Pose& b) { return (a.position - b.position).norm(); }
double turn_error(const Pose& a, const Pose& b) { return a.rotation.angularDistance(b.rotation); }

/// What the encoders tell.
Lengths counted(const Geometry& geometry, const Lengths& lengths) {
  return (lengths / geometry.metres_per_count).array().round() * geometry.metres_per_count;
}

TEST(PoseSolver, ColdStart_FindsAnyPoseOrSaysThatItDoesNot) {
  for (const char* name : test::kDevices) {
    const Geometry geometry = test::device(name);
    test::Dice dice(5);
    int found = 0;
    constexpr int kTrials = 2000;
    for (int trial = 0; trial < kTrials; ++trial) {
      PoseSolver solver(geometry);
      const Pose pose = dice.pose(0.03, 60.0 * kDegrees);
      const PoseEstimate estimate = solver.solve(string_lengths(geometry, pose));
      if (!estimate.converged || estimate.suspicious) continue;
      ++found;
      EXPECT_LT(position_error(estimate.pose, pose), 1e-8) << name << " " << trial;
      EXPECT_LT(turn_error(estimate.pose, pose), 1e-6) << name << " " << trial;
    }
    EXPECT_EQ(found, kTrials) << name;
  }
}

/// A fast hand: 2 Hz, 3 cm and 30 degrees each way.
Pose hand_at(double time) {
  const double phase = 2.0 * std::numbers::pi * 2.0 * time;
  return {.rotation = math::exp_rotation(30.0 * kDegrees *
                                         Vector3d(std::sin(phase), 0.5 * std::cos(0.7 * phase), std::sin(1.3 * phase))),
          .position = 0.03 * Vector3d(std::sin(phase), std::cos(1.1 * phase), 0.5 * std::sin(0.9 * phase))};
}

TEST(PoseSolver, FastHand_ReachesTheEncodersFloorInTwoSteps) {
  for (const char* name : test::kDevices) {
    const Geometry geometry = test::device(name);
    PoseSolver solver(geometry);
    (void)solver.solve(string_lengths(geometry, hand_at(0.0)));
    double position = 0.0, turn = 0.0, position_floor = 0.0, turn_floor = 0.0;
    for (int tick = 1; tick <= 4000; ++tick) {
      const Pose pose = hand_at(1e-3 * tick);
      const PoseEstimate estimate = solver.solve(counted(geometry, string_lengths(geometry, pose)));
      ASSERT_TRUE(estimate.converged);
      EXPECT_FALSE(estimate.suspicious);
      EXPECT_LE(estimate.iterations, 4);
      const auto covariance = pose_covariance(geometry, pose);
      position += std::pow(position_error(estimate.pose, pose), 2);
      turn += std::pow(turn_error(estimate.pose, pose), 2);
      position_floor += covariance.topLeftCorner<3, 3>().trace();
      turn_floor += covariance.bottomRightCorner<3, 3>().trace();
    }
    // 4000 ticks: the mean square of the rounding's is known to some per cent.
    EXPECT_LT(std::sqrt(position / position_floor), 1.2) << name;
    EXPECT_LT(std::sqrt(turn / turn_floor), 1.2) << name;
    EXPECT_GT(std::sqrt(position / position_floor), 0.8) << name << ": the floor must be the right one";
  }
}

TEST(PoseSolver, OneStringWrong_IsNoticedAndMostlyNamed) {
  const Geometry geometry = test::device("g6x3");
  test::Dice dice(6);
  int noticed = 0;
  int named = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Pose pose = dice.pose(0.02, 30.0 * kDegrees);
    PoseSolver solver(geometry);
    (void)solver.solve(string_lengths(geometry, pose));
    Lengths lengths = string_lengths(geometry, pose);
    const int wrong = trial % kStrings;
    lengths[wrong] += 0.01;  // slack
    const PoseEstimate estimate = solver.solve(lengths);
    noticed += estimate.suspicious ? 1 : 0;
    named += estimate.suspect == wrong ? 1 : 0;
    if (estimate.suspect == wrong) {
      EXPECT_NEAR(estimate.excess, 0.01, 1e-4);
    }
  }
  // A string that the balance of tensions hardly needs shows little; two that are placed alike cannot be told apart.
  EXPECT_GE(noticed, 195);
  EXPECT_GE(named, 185);
}

TEST(PoseSolver, StringTooShort_ItsExcessIsBelowZero) {
  const Geometry geometry = test::device("g6x4");
  PoseSolver solver(geometry);
  Lengths lengths = string_lengths(geometry, hand_at(0.2));
  ASSERT_EQ(solver.solve(lengths).excess, 0.0);
  lengths[2] -= 0.004;  // slipped
  const PoseEstimate estimate = solver.solve(lengths);
  ASSERT_EQ(estimate.suspect, 2);
  EXPECT_NEAR(estimate.excess, -0.004, 1e-5);
}

TEST(PoseSolver, LengthsThatAreNotFinite_KeepTheLastPose) {
  const Geometry geometry = test::device("g6x5");
  PoseSolver solver(geometry);
  const Pose pose = hand_at(0.1);
  const PoseEstimate good = solver.solve(string_lengths(geometry, pose));
  Lengths bad = string_lengths(geometry, pose);
  bad[3] = std::numeric_limits<double>::quiet_NaN();
  const PoseEstimate estimate = solver.solve(bad);
  EXPECT_FALSE(estimate.converged);
  EXPECT_EQ(estimate.pose.position, good.pose.position);
  EXPECT_TRUE(solver.solve(string_lengths(geometry, pose)).converged);
}

TEST(PoseSolver, LengthsOfNoPose_AreSuspicious) {
  const Geometry geometry = test::device("g6x3");
  PoseSolver solver(geometry);
  const PoseEstimate estimate = solver.solve(Lengths::Constant(1.0));
  EXPECT_TRUE(estimate.suspicious || !estimate.converged);
  EXPECT_TRUE(solver.solve(string_lengths(geometry, {})).converged) << "and it recovers";
}

}  // namespace
}  // namespace layfigure::spidar
