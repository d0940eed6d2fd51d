#include "layfigure/device/simulated_spidar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "allocation_count.h"
#include "layfigure/device/open.h"

namespace layfigure::device {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTick = 1e-3;  // [s]
// What the least tension that keeps strings from sagging, and the pulleys' friction, leave of no force [N].
constexpr double kNoForce = 0.8;

struct Rig {
  Device device;
  SimulatedSpidarDriver& driver;
  double time{0.0};
  Reading reading;
  Wrench sent;

  explicit Rig(Device opened)
      : device(std::move(opened)), driver(dynamic_cast<SimulatedSpidarDriver&>(device.driver())) {}
  Rig() : Rig(open_device({.kind = "spidar-g6", .config = {}, .index = 0, .bus_url = {}, .channel_prefix = {}})) {}

  void tick(const Wrench& wanted = {}) {
    time += kTick;
    reading = device.read(time);
    sent = device.write(time, wanted);
  }
  void run(double seconds, const Wrench& wanted = {}) {
    for (int k = 0; k < std::lround(seconds / kTick); ++k) tick(wanted);
  }
};

const Wrench kPush{.force = {2.0, 3.0, -2.0}};

TEST(SimulatedSpidarDriver, Frames_ThereAndBackAreTheSame) {
  const Vector3d position(0.01, -0.02, 0.03);
  const Quaterniond rotation = Quaterniond(0.9, 0.1, -0.3, 0.2).normalized();
  const Reading there = to_reading(to_spidar(position, rotation));
  EXPECT_EQ(there.position, position);
  EXPECT_EQ(there.rotation.coeffs(), rotation.coeffs());
  // The geometry's y, up, is the device's z.
  EXPECT_EQ(to_reading({.rotation = Quaterniond::Identity(), .position = {0.0, 1.0, 0.0}}).position, Vector3d::UnitZ());
  // A turn of a point and the point turned agree.
  const Vector3d point(0.3, 0.5, -0.7);
  const spidar::Pose turn = to_spidar(Vector3d::Zero(), rotation);
  const Vector3d in_geometry = turn.rotation * to_spidar(point, rotation).position;
  const Vector3d back = to_reading({.rotation = Quaterniond::Identity(), .position = in_geometry}).position;
  EXPECT_LT((back - rotation * point).norm(), 1e-14);
}

TEST(SimulatedSpidarDriver, Aimed_TheReadingGoesThere) {
  Rig rig;
  const Vector3d wanted(0.01, 0.015, -0.02);
  const Quaterniond turn(Eigen::AngleAxisd(0.3, Vector3d(1.0, 2.0, 2.0).normalized()));
  rig.device.aim(wanted, turn);
  rig.run(2.0);
  ASSERT_EQ(rig.reading.status, Reading::Status::kOk);
  // Friction of the pulleys, 0.05 N each, against the arm's 135 N/m.
  EXPECT_LT((rig.reading.position - wanted).norm(), 5e-3);
  EXPECT_LT(rig.reading.rotation.angularDistance(turn), 0.15);
}

TEST(SimulatedSpidarDriver, Pushed_TheHandGivesWayAlongTheForce) {
  Rig rig;
  rig.run(0.1);
  rig.run(3.0, kPush);
  EXPECT_EQ(rig.sent.force, kPush.force);
  EXPECT_LT((rig.driver.exerted().force - kPush.force).norm(), kNoForce);
  EXPECT_GT(rig.reading.position.normalized().dot(kPush.force.normalized()), 0.95);
  EXPECT_NEAR(rig.reading.position.norm(), kPush.force.norm() * (1.0 / 135.0 + 1.0 / 700.0), 6e-3);
}

TEST(SimulatedSpidarDriver, SameCalls_SameBits) {
  std::vector<Vector3d> first;
  for (int run = 0; run < 2; ++run) {
    Rig rig;
    for (int k = 0; k < 2000; ++k) {
      const double phase = 2e-2 * k;
      rig.device.aim(0.01 * Vector3d(std::sin(phase), std::cos(phase), 0.0), Quaterniond::Identity());
      rig.tick({.force = {std::cos(phase), 0.0, std::sin(phase)}});
      if (run == 0) {
        first.push_back(rig.reading.position);
      } else {
        ASSERT_EQ(rig.reading.position, first[static_cast<std::size_t>(k)]) << k;
      }
    }
  }
}

TEST(SimulatedSpidarDriver, Tick_AllocatesNothing) {
  Rig rig;
  rig.run(1.0, kPush);
  const long before = testing::allocation_count();
  rig.run(0.5, kPush);
  rig.run(0.1, {.force = {500.0, 0.0, 0.0}, .torque = {0.0, 90.0, 0.0}});
  EXPECT_EQ(testing::allocation_count(), before);
}

/// From a fault on: no force is asked of the driver, or exerted, within 10 ms, whatever the doll asks for.
void expect_no_force_in_time(Rig& rig, const Wrench& wanted, double none = kNoForce) {
  rig.run(0.010, wanted);
  EXPECT_TRUE(rig.sent.is_zero()) << fault_name(rig.device.report().fault);
  rig.run(0.002, wanted);  // the motors' own lag, 0.5 ms, and the one tick until they are told
  EXPECT_LT(rig.driver.exerted().force.norm(), none) << fault_name(rig.device.report().fault);
}

TEST(SimulatedSpidarFaults, BrokenString_NoForceWithinTenMilliseconds) {
  Rig rig;
  rig.run(1.0, kPush);
  ASSERT_GT(rig.driver.exerted().force.norm(), 3.0);
  rig.driver.faults().broken_string = 3;
  expect_no_force_in_time(rig, kPush);
  EXPECT_EQ(rig.device.report().fault, Fault::kInvalid);
  EXPECT_EQ(rig.reading.status, Reading::Status::kInvalid);
}

TEST(SimulatedSpidarFaults, Disconnected_NoForceWithinTenMilliseconds) {
  Rig rig;
  rig.run(1.0, kPush);
  rig.driver.faults().silent = true;
  expect_no_force_in_time(rig, kPush, 0.1);
  EXPECT_EQ(rig.device.report().fault, Fault::kGone);
  rig.driver.faults().silent = false;
  rig.run(2.0, kPush);
  EXPECT_EQ(rig.device.report().fault, Fault::kNone) << "and comes back";
  EXPECT_EQ(rig.sent.force, kPush.force);
}

TEST(SimulatedSpidarFaults, StuckEncoder_NoForceWithinTenMillisecondsOfTheRejection) {
  Rig rig;
  rig.run(1.0, kPush);
  rig.driver.faults().stuck_encoder = 2;
  // A grip at rest is not told from one whose encoder is stuck; one that moves is, as soon as the lengths fit no pose.
  rig.device.aim({0.03, 0.0, 0.0}, Quaterniond::Identity());
  double moved = 0.0;
  const Vector3d from = rig.driver.spidar().grip().position;
  while (rig.device.report().fault == Fault::kNone && moved < 0.02) {
    rig.tick(kPush);
    moved = (rig.driver.spidar().grip().position - from).norm();
  }
  EXPECT_EQ(rig.device.report().fault, Fault::kInvalid);
  EXPECT_LT(moved, 2e-3) << "some counts are enough";
  expect_no_force_in_time(rig, kPush);
}

TEST(SimulatedSpidarFaults, WrenchNotFinite_NoForceWithinTenMilliseconds) {
  Rig rig;
  rig.run(1.0, kPush);
  Wrench bad = kPush;
  bad.torque.y() = std::numeric_limits<double>::quiet_NaN();
  expect_no_force_in_time(rig, bad);
  EXPECT_EQ(rig.reading.status, Reading::Status::kOk) << "the pose is still good";
}

TEST(SimulatedSpidarFaults, CallerThatStops_TheStringsLetGo) {
  Rig rig;
  rig.run(1.0, kPush);
  for (int k = 0; k < 16; ++k) (void)rig.driver.read(rig.time += kTick);
  EXPECT_LT(rig.driver.exerted().force.norm(), 0.1);
}

TEST(SimulatedSpidarFaults, CallerThatComesBackLate_NoForceAtOnce) {
  Rig rig;
  rig.run(1.0, kPush);
  rig.time += 0.05;
  rig.tick(kPush);
  EXPECT_TRUE(rig.sent.is_zero());
  EXPECT_EQ(rig.device.report().last_fault, Fault::kLate);
  rig.run(1.0, kPush);
  EXPECT_EQ(rig.sent.force, kPush.force);
}

TEST(SimulatedSpidarFaults, TimeOrAimNotFinite_IsNotTaken) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Rig rig;
  EXPECT_EQ(rig.driver.read(kNan).status, Reading::Status::kNothingNew);
  rig.device.aim({kNan, 0.0, 0.0}, Quaterniond::Identity());
  rig.device.aim({0.01, 0.0, 0.0}, Quaterniond(0.0, 0.0, 0.0, 0.0));
  rig.run(1.0, kPush);
  EXPECT_EQ(rig.reading.status, Reading::Status::kOk);
  EXPECT_EQ(rig.sent.force, kPush.force);
  EXPECT_EQ(rig.driver.read(kNan).status, Reading::Status::kNothingNew);
}

TEST(SimulatedSpidarFaults, Closed_NoForceAnyMore) {
  Rig rig;
  rig.run(1.0, kPush);
  rig.device.close();
  expect_no_force_in_time(rig, kPush, 0.1);
}

TEST(SimulatedSpidarFaults, RandomFaults_NothingUnfitComesThrough) {
  Rig rig;
  std::uint32_t seed = 12345;
  const auto random = [&seed] { return (seed = seed * 1664525u + 1013904223u) >> 8; };
  for (int k = 0; k < 20'000; ++k) {
    spidar::SimulatedFaults& faults = rig.driver.faults();
    if (random() % 50 == 0) faults = {};
    if (random() % 100 == 0) faults.broken_string = static_cast<int>(random() % 8);
    if (random() % 100 == 0) faults.stuck_encoder = static_cast<int>(random() % 8);
    if (random() % 100 == 0) faults.silent = true;
    if (random() % 100 == 0) rig.time += 0.02;
    Wrench wanted = kPush;
    if (random() % 100 == 0) wanted.force.x() = std::numeric_limits<double>::quiet_NaN();
    rig.tick(wanted);
    ASSERT_TRUE(rig.reading.position.allFinite());
    ASSERT_NEAR(rig.reading.rotation.norm(), 1.0, 1e-9);
    ASSERT_TRUE(rig.sent.is_finite());
    ASSERT_LE(rig.sent.force.norm(), rig.device.info().max_force);
    ASSERT_TRUE(rig.driver.exerted().is_finite());
  }
  EXPECT_GT(rig.device.report().trips, 10);
}

}  // namespace
}  // namespace layfigure::device
