#include "layfigure/spidar/calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "devices.h"
#include "layfigure/spidar/pose_solver.h"

namespace layfigure::spidar {
namespace {

constexpr double kDegrees = std::numbers::pi / 180.0;
constexpr double kDistance = 0.025;        // [m]
constexpr double kTurn = 35.0 * kDegrees;  // [rad]

struct Device {
  Geometry truth;  ///< its offsets are those to be found
  test::Dice dice;

  Device(const std::string& name, unsigned seed, double offset) : truth(test::device(name)), dice(seed) {
    for (int i = 0; i < kStrings; ++i) truth.offsets[i] = dice.between(-offset, offset);
  }

  Recording record(bool with_pose = false) {
    const Pose pose = dice.pose(kDistance, kTurn);
    Recording recording{
        .told = ((string_lengths(truth, pose) - truth.offsets) / truth.metres_per_count).array().round() *
                truth.metres_per_count,
        .pose = {}};
    if (with_pose) recording.pose = pose;
    return recording;
  }
  std::vector<Recording> record_many(int count, bool with_pose = false) {
    std::vector<Recording> recordings;
    for (int k = 0; k < count; ++k) recordings.push_back(record(with_pose));
    return recordings;
  }
};

std::string refusal(const Geometry& start, const std::vector<Recording>& recordings, bool motors = false) {
  try {
    (void)calibrate(start, recordings, motors);
  } catch (const CalibrationError& error) {
    return error.what();
  }
  return "";
}

TEST(Calibration, HomedAtAKnownPose_LengthsThereAreExact) {
  const Geometry geometry = test::device("g6x3");
  const Pose rest{.rotation = math::exp_rotation({0.1, 0.0, 0.0}), .position = {0.0, -0.02, 0.0}};
  const Lengths told = string_lengths(geometry, rest).array() - 0.07;
  EXPECT_LT(((told + offsets_at(geometry, rest, told)) - string_lengths(geometry, rest)).norm(), 1e-15);
}

TEST(Calibration, ManyUnknownPoses_FindTheOffsetsWithinTheirDeviations) {
  for (const char* name : test::kDevices) {
    Device device(name, 31, 3e-3);
    const Calibration found = calibrate(test::device(name), device.record_many(300));
    const double rounding = device.truth.metres_per_count / std::sqrt(12.0);
    EXPECT_GT(found.residual_before, 10.0 * rounding) << name;
    EXPECT_NEAR(found.residual, rounding, 0.15 * rounding) << name << ": rounding is all that is left";
    for (int i = 0; i < kStrings; ++i) {
      // Four standard deviations: once in 16 000 numbers by chance, and the dice are fixed.
      EXPECT_LT(std::abs(found.geometry.offsets[i] - device.truth.offsets[i]), 4.0 * found.offset_deviation[i])
          << name << " " << i;
      EXPECT_LT(found.offset_deviation[i], 20.0 * rounding) << name << " " << i;
    }
  }
}

TEST(Calibration, KnownPoses_FindOffsetsAndMotors) {
  Device device("g6x3", 32, 3e-3);
  for (auto& motor : device.truth.motors) motor += 1e-3 * device.dice.direction();
  const Calibration found = calibrate(test::device("g6x3"), device.record_many(200, true), true);
  EXPECT_LT((found.geometry.offsets - device.truth.offsets).cwiseAbs().maxCoeff(),
            4.0 * found.offset_deviation.maxCoeff());
  for (int i = 0; i < kStrings; ++i) {
    EXPECT_LT((found.geometry.motors[i] - device.truth.motors[i]).norm(), 4.0 * std::sqrt(3.0) * found.motor_deviation);
  }
  EXPECT_LT(found.motor_deviation, 1e-4);
}

TEST(Calibration, UnknownPosesWithMotors_FitAsRoundingDoes) {
  Device device("g6x4", 33, 2e-3);
  for (auto& motor : device.truth.motors) motor += 5e-4 * device.dice.direction();
  const Calibration found = calibrate(test::device("g6x4"), device.record_many(600), true);
  const double rounding = device.truth.metres_per_count / std::sqrt(12.0);
  EXPECT_LT(found.residual, 1.2 * rounding);
  // Poses that were not recorded fit as well: what was found is the device, not the recordings.
  for (const Recording& fresh : device.record_many(50)) {
    PoseSolver solver(found.geometry);
    const PoseEstimate estimate = solver.solve(fresh.told + found.geometry.offsets);
    EXPECT_TRUE(estimate.converged);
    EXPECT_LT(estimate.misfit, 6.0 * rounding);
  }
}

TEST(Calibration, TooFewOrTooAlike_Refused) {
  Device device("g6x3", 34, 1e-3);
  const Geometry start = test::device("g6x3");
  EXPECT_NE(refusal(start, {}).find("record more poses"), std::string::npos);
  EXPECT_NE(refusal(start, device.record_many(3)).find("3 recordings leave 6 equations for 8"), std::string::npos);
  const std::vector<Recording> same(50, device.record());
  EXPECT_NE(refusal(start, same).find("do not determine"), std::string::npos) << refusal(start, same);
  EXPECT_EQ(refusal(start, same).find('\n'), std::string::npos);
  EXPECT_EQ(refusal(start, device.record_many(200)), "");
}

TEST(Calibration, NotFiniteOrOfNoPose_Refused) {
  Device device("g6x3", 35, 1e-3);
  std::vector<Recording> recordings = device.record_many(50);
  recordings[7].told[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(device.truth, recordings).find("recording 7"), std::string::npos);
  recordings[7] = device.record(true);
  recordings[7].pose->position.x() = std::numeric_limits<double>::infinity();
  EXPECT_NE(refusal(device.truth, recordings).find("recording 7"), std::string::npos);
}

}  // namespace
}  // namespace layfigure::spidar
