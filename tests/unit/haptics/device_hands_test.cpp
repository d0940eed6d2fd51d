#include "layfigure/haptics/device_hands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "allocation_count.h"
#include "fake_device.h"
#include "layfigure/device/open.h"
#include "layfigure/device/simulated_spidar.h"
#include "small_doll.h"

namespace layfigure::haptics {
namespace {

using testing::FakeDriver;

constexpr double kStep = 1e-3;        // [s]
constexpr double kSafeWithin = 0.01;  // [s] of a fault to no force
const int kTip = 3;                   // the bone at the end of the small doll's arm

/// The small doll with a device at pointer 0.
struct Rig {
  explicit Rig(std::unique_ptr<device::Driver> opened) : hands(testing::small_doll(), kStep) {
    driver = opened.get();
    devices = DeviceHands(testing::one_device(std::move(opened)));
    devices.place_around(hands);
  }

  void pass(double seconds) {
    for (long n = std::lround(seconds / kStep); n > 0; --n) step();
  }
  void step() {
    devices.follow_buttons(hands);
    devices.begin_step(time, hands);
    EXPECT_EQ(hands.step().status, dynamics::StepStatus::kOk);
    devices.end_step(time, hands);
    time += kStep;
  }
  [[nodiscard]] const Pointer& pointer() const { return hands.pointers().at(0); }
  [[nodiscard]] Eigen::Vector3d tip() const {
    doll::SkeletonPose skeleton;
    std::vector<dynamics::BodyPose> poses;
    dynamics::world_poses(hands.model(), hands.state(), poses);
    const doll::Carrier& carrier = hands.doll().carriers[kTip];
    return poses[carrier.body].origin + poses[carrier.body].rotation * carrier.pose.translation();
  }

  Hands hands;
  DeviceHands devices;
  device::Driver* driver{nullptr};
  double time{0.0};
};

Rig spidar_rig() { return Rig(device::open_driver({.kind = "spidar-g6x3"})); }

spidar::SimulatedFaults& faults(const Rig& rig) {
  return dynamic_cast<device::SimulatedSpidarDriver&>(*rig.driver).faults();
}

/// Holds the tip with the simulated hand, which then goes up.
void pull_up(Rig& rig, double way) {
  rig.pass(0.1);
  const Eigen::Vector3d tip = rig.tip();
  rig.devices.guide(0, {.position = tip}, rig.hands);
  rig.hands.grab({.pointer = 0, .bone = kTip});
  rig.devices.guide(0, {.position = tip + way * Eigen::Vector3d::UnitZ()}, rig.hands);
  rig.devices.glide(0, std::lround(0.5 / kStep));
  rig.pass(1.5);
}

TEST(DeviceHands, AtFirst_ReachCoversTheDoll) {
  const Rig rig = spidar_rig();
  const double reach = rig.devices.info(0).reach;
  // The doll is 0.6 m long, along x.
  EXPECT_NEAR(rig.pointer().map().scale() * reach, 0.3, 0.05);
}

TEST(DeviceHands, AtFirst_GripOfDefaultStiffnessIsFeltTheSameForAnyDoll) {
  const Rig rig = spidar_rig();
  const WorkspaceMap& map = rig.pointer().map();
  const double felt = map.power_scale() * map.scale() * map.scale() * rig.hands.default_stiffness();
  EXPECT_NEAR(felt, kFeltStiffness, 1e-9 * kFeltStiffness);
}

TEST(DeviceHands, TwoDevices_StandSideBySideLeftFirst) {
  std::vector<device::Device> devices;
  devices.emplace_back(std::make_unique<FakeDriver>());
  devices.emplace_back(std::make_unique<FakeDriver>());
  Hands hands(testing::small_doll(), kStep);
  DeviceHands two(std::move(devices));
  two.place_around(hands);
  two.begin_step(0.0, hands);
  EXPECT_LT(hands.pointers().at(0).pose().position.x(), hands.pointers().at(1).pose().position.x());
  EXPECT_TRUE(two.drives(1));
  EXPECT_FALSE(two.drives(2));
}

TEST(DeviceHands, GuidedWithoutATool_PointerIsThereAtOnceAndTheGripStays) {
  Rig rig = spidar_rig();
  rig.pass(0.1);
  const Eigen::Vector3d grip = rig.devices.seen(0).reading.position;
  const Eigen::Vector3d goal(0.5, 0.1, 1.0);
  rig.devices.guide(0, {.position = goal}, rig.hands);
  EXPECT_EQ(rig.pointer().pose().position, goal);
  rig.pass(0.1);
  EXPECT_LT((rig.pointer().pose().position - goal).norm(), 1e-3);
  EXPECT_LT((rig.devices.seen(0).reading.position - grip).norm(), 1e-4);
}

TEST(DeviceHands, SimulatedHandPulls_DollFollowsAndTheHandFeelsIt) {
  Rig rig = spidar_rig();
  rig.pass(2.0);  // the arm sinks a little under its weight
  const double before = rig.tip().z();
  pull_up(rig, 0.1);
  EXPECT_GT(rig.tip().z(), before + 1e-3);
  const dynamics::BodyForce felt = rig.pointer().force_on_hand();
  EXPECT_LT(felt.force.z(), 0.0) << "the doll pulls the hand down";
  const device::Wrench exerted = rig.driver->exerted();
  // The strings exert what is asked for, but for the motors' lag and the pulleys' friction.
  EXPECT_NEAR(exerted.force.z(), felt.force.z(), 0.15 + 0.1 * felt.force.norm());
}

TEST(DeviceHands, SameCalls_SameBits) {
  Rig a = spidar_rig();
  Rig b = spidar_rig();
  pull_up(a, 0.02);
  pull_up(b, 0.02);
  EXPECT_EQ(a.tip(), b.tip());
  EXPECT_EQ(a.devices.seen(0).reading.position, b.devices.seen(0).reading.position);
}

TEST(DeviceHands, PowerScale_ScalesForceAndTorqueAlike) {
  Rig rig = spidar_rig();
  pull_up(rig, 0.03);
  const dynamics::BodyForce before = rig.pointer().force_on_hand();
  rig.hands.set_power_scale(0, 0.5 * rig.pointer().map().power_scale());
  EXPECT_EQ(rig.pointer().force_on_hand().force, 0.5 * before.force);
  EXPECT_EQ(rig.pointer().force_on_hand().torque, 0.5 * before.torque);
}

class FaultyDevice : public ::testing::TestWithParam<int> {};

TEST_P(FaultyDevice, WhileItPulls_NoForceWithinTenMillisecondsAndAValidDoll) {
  Rig rig = spidar_rig();
  pull_up(rig, 0.03);
  ASSERT_GT(rig.driver->exerted().force.norm(), 0.05);
  if (GetParam() == 0) faults(rig).broken_string = 2;
  if (GetParam() == 1) faults(rig).silent = true;
  // A broken string is noticed when its length no longer fits: until then it is the device's own fault that pulls.
  double since_noticed = 0.0;
  for (int n = 0; n < 500 && since_noticed <= kSafeWithin; ++n) {
    rig.step();
    if (rig.devices.seen(0).report.fault != device::Fault::kNone) since_noticed += kStep;
  }
  ASSERT_GT(since_noticed, kSafeWithin);
  EXPECT_EQ(rig.devices.seen(0).report.share, 0.0);
  rig.pass(0.5);
  EXPECT_TRUE(rig.tip().allFinite());
}

INSTANTIATE_TEST_SUITE_P(BrokenStringAndSilence, FaultyDevice, ::testing::Values(0, 1));

TEST(DeviceHands, PoseIsNotFinite_PointerStays) {
  auto driver = std::make_unique<FakeDriver>();
  FakeDriver& fake = *driver;
  Rig rig(std::move(driver));
  rig.pass(0.01);
  const Eigen::Vector3d before = rig.pointer().pose().position;
  fake.reading.position.x() = std::numeric_limits<double>::quiet_NaN();
  rig.pass(0.05);
  EXPECT_EQ(rig.pointer().pose().position, before);
  EXPECT_TRUE(fake.told.is_zero());
  EXPECT_EQ(rig.devices.seen(0).report.fault, device::Fault::kNotFinite);
}

TEST(DeviceHands, SqueezeNearTheSkin_GrabsAndOpeningLetsGo) {
  auto driver = std::make_unique<FakeDriver>();
  FakeDriver& fake = *driver;
  Rig rig(std::move(driver));
  rig.pass(0.01);
  rig.devices.guide(0, {.position = rig.tip()}, rig.hands);
  fake.reading.grip = 1.0;
  rig.pass(0.01);
  EXPECT_EQ(rig.pointer().tool(), Tool::kGrab);
  fake.reading.grip = 0.5;
  rig.pass(0.01);
  EXPECT_EQ(rig.pointer().tool(), Tool::kGrab) << "a little opening does not let go";
  fake.reading.grip = 0.0;
  rig.pass(0.01);
  EXPECT_EQ(rig.pointer().tool(), Tool::kNone);
}

TEST(DeviceHands, SqueezeFarFromTheSkin_HoldsNothing) {
  auto driver = std::make_unique<FakeDriver>();
  FakeDriver& fake = *driver;
  Rig rig(std::move(driver));
  rig.devices.guide(0, {.position = {0.0, 5.0, 0.0}}, rig.hands);
  fake.reading.buttons = 1;
  rig.pass(0.01);
  EXPECT_EQ(rig.pointer().tool(), Tool::kNone);
}

TEST(DeviceHands, SecondButton_IsTheClutch) {
  auto driver = std::make_unique<FakeDriver>();
  FakeDriver& fake = *driver;
  Rig rig(std::move(driver));
  rig.pass(0.01);
  const Eigen::Vector3d before = rig.pointer().pose().position;
  fake.reading.buttons = 2;
  rig.pass(0.01);
  fake.reading.position.x() = 0.01;
  rig.pass(0.01);
  EXPECT_EQ(rig.pointer().pose().position, before);
  fake.reading.buttons = 0;
  rig.pass(0.01);
  EXPECT_LT((rig.pointer().pose().position - before).norm(), 1e-12) << "and no jump when it is let go";
}

TEST(DeviceHands, RegrabWithinOneStep_TakesTheForceAway) {
  Rig rig = spidar_rig();
  pull_up(rig, 0.02);
  const double before = rig.pointer().force_on_hand().force.norm();
  ASSERT_GT(before, 0.0);
  for (int times = 0; times < 2; ++times) {
    rig.hands.release(0);
    rig.hands.grab({.pointer = 0, .bone = kTip});
  }
  rig.step();
  // What is left damps the simulated hand, which was let go all at once.
  EXPECT_LT(rig.pointer().force_on_hand().force.norm(), 0.5 * before);
  EXPECT_EQ(rig.devices.seen(0).report.fault, device::Fault::kNone);
}

TEST(DeviceHands, Step_AllocatesNothing) {
  Rig rig = spidar_rig();
  pull_up(rig, 0.01);
  const long before = testing::allocation_count();
  for (int n = 0; n < 100; ++n) {
    rig.devices.begin_step(rig.time, rig.hands);
    rig.devices.end_step(rig.time, rig.hands);
    rig.time += kStep;
  }
  EXPECT_EQ(testing::allocation_count(), before);
}

}  // namespace
}  // namespace layfigure::haptics
