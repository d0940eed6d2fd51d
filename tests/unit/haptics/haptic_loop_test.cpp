// Devices served at the haptic rate between steps of the doll.
#include "layfigure/haptics/haptic_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "allocation_count.h"
#include "fake_device.h"
#include "layfigure/device/open.h"
#include "pinched_doll.h"
#include "served_rig.h"

namespace layfigure::haptics {
namespace {

using testing::FakeDriver;
using testing::kTip;
using testing::kTremor;
using testing::pull_up;
using testing::pulled;
using testing::ServedRig;

constexpr double kFelt = 0.03;  // part of the stiffness by which a rate may change it

/// What a hand feels more [N] that has moved a grip by so much [m].
double felt_by_moving(double physics_hz, int ticks, double way) {
  auto driver = std::make_unique<FakeDriver>();
  FakeDriver& fake = *driver;
  fake.tremor = kTremor;
  ServedRig rig(std::move(driver), physics_hz, ticks);
  rig.pass(1.0);
  rig.devices.guide(0, {.position = rig.tip()}, rig.hands);
  rig.hands.grab({.pointer = 0, .bone = kTip});
  rig.pass(3.0);
  const double before = fake.told.force.z();
  for (int k = 1; k <= 50; ++k) {
    fake.reading.position.z() = way * k / 50.0;
    rig.pass(0.02);
  }
  rig.pass(5.0);
  EXPECT_EQ(rig.devices.seen(0).report.share, 1.0) << physics_hz;
  return fake.told.force.z() - before;
}

TEST(HapticLoop, PhysicsFrom50To500Hz_StiffnessIsFeltAsOfFullSteps) {
  constexpr double kWay = 2e-3;
  const double whole = felt_by_moving(2000.0, 1, kWay);
  ASSERT_LT(whole, -0.05) << "the doll resists";
  for (const double physics_hz : {50.0, 100.0, 250.0, 500.0}) {
    const double felt = felt_by_moving(physics_hz, static_cast<int>(2000.0 / physics_hz), kWay);
    EXPECT_NEAR(felt, whole, kFelt * std::abs(whole)) << physics_hz;
  }
}

TEST(HapticLoop, SimulatedHandOnPhysicsOf50Hz_PullsAndFeels) {
  const auto rig = pulled(50.0, 40);
  EXPECT_EQ(rig->devices.seen(0).report.fault, device::Fault::kNone);
  EXPECT_EQ(rig->devices.seen(0).report.trips, 0);
  EXPECT_LT(rig->pointer().force_on_hand().force.z(), -0.05);
  EXPECT_GT(rig->pointer().grip()->force.force.z(), 0.0);
  EXPECT_EQ(rig->devices.tick_window().whole().ticks, 40 * std::lround(1.6 * 50.0));
}

TEST(HapticLoop, SameCalls_SameBits) {
  const auto a = pulled(100.0, 10);
  const auto b = pulled(100.0, 10);
  EXPECT_EQ(a->tip(), b->tip());
  EXPECT_EQ(a->devices.seen(0).hand.position, b->devices.seen(0).hand.position);
}

TEST(HapticLoop, GrabReleaseGrabElsewhere_NothingJumps) {
  const auto rig = pulled(100.0, 10);
  rig->hands.release(0);
  rig->step();
  EXPECT_TRUE(rig->pointer().force_on_hand().force.isZero(0.0));
  rig->pass(0.5);
  rig->hands.grab({.pointer = 0, .bone = 1});
  rig->step();
  EXPECT_LT(rig->pointer().grip()->force.force.norm(), 1.0) << "the held point is where the hand took it";
  rig->pass(0.5);
  EXPECT_TRUE(rig->tip().allFinite());
}

TEST(HapticLoop, DollThatRestedIsPulledAndLetGo_SpringsBack) {
  ServedRig rig(device::open_driver({.kind = "spidar-g6x3"}), 100.0, 10);
  rig.pass(60.0);
  ASSERT_TRUE(rig.hands.state().rest.resting);
  const Eigen::Vector3d rest = rig.tip();
  pull_up(rig);
  const double way = (rig.tip() - rest).norm();
  ASSERT_GT(way, 1e-3);
  rig.hands.release(0);
  rig.pass(2.0);
  EXPECT_LT((rig.tip() - rest).norm(), 0.5 * way);
}

TEST(HapticLoop, FingertipOnALimb_PressesAndFeelsIt) {
  for (const double physics_hz : {50.0, 500.0}) {
    auto driver = std::make_unique<FakeDriver>();
    FakeDriver& fake = *driver;
    ServedRig rig(std::move(driver), physics_hz, static_cast<int>(2000.0 / physics_hz), testing::thick_doll());
    rig.pass(1.0);
    std::vector<dynamics::BodyPose> poses;
    dynamics::world_poses(rig.hands.model(), rig.hands.state(), poses);
    const Eigen::Vector3d above = poses[2].com + (testing::kLimbRadius + 0.012) * Eigen::Vector3d::UnitZ();
    rig.devices.guide(0, {.position = above}, rig.hands);
    rig.hands.touch({.pointer = 0});
    rig.pass(0.5);
    EXPECT_FALSE(rig.pointer().fingertip()->touched.contact);
    EXPECT_TRUE(fake.told.force.norm() < 1e-3) << fake.told.force.transpose();
    fake.tremor = kTremor;
    const double scale = rig.pointer().map().scale();
    for (int k = 1; k <= 50; ++k) {
      fake.reading.position.z() = -0.03 / scale * k / 50.0;
      rig.pass(0.02);
    }
    rig.pass(1.0);
    EXPECT_TRUE(rig.pointer().fingertip()->touched.contact) << physics_hz;
    EXPECT_EQ(rig.pointer().fingertip()->touched.body, 2);
    EXPECT_GT(rig.pointer().fingertip()->touched.force.z(), 0.1) << "the limb pushes the finger up";
    EXPECT_GT(fake.told.force.z(), 0.05) << "and the hand";
    dynamics::world_poses(rig.hands.model(), rig.hands.state(), poses);
    const double tip = poses[rig.pointer().grip()->coupling.body].origin.z();
    EXPECT_NEAR(tip - poses[2].com.z(), testing::kLimbRadius + kFingertipRadius, 2e-3) << "it lies on the limb";
  }
}

TEST(HapticLoop, FingertipsThatTiltInCircles_KeepWhatTheyHold) {
  constexpr double kHapticRate = 2000.0;
  constexpr double kClearance = 2e-4;  // [m]
  constexpr double kSqueeze = 0.01;    // [m]
  constexpr double kClosing = 0.03;    // [s]
  constexpr double kTilt = 0.35;       // [rad]
  constexpr int kCircles = 10;         // one a second
  for (const double physics_hz : {100.0, 500.0}) {
    SCOPED_TRACE(physics_hz);
    const double h = 1.0 / physics_hz;
    const int ticks = static_cast<int>(kHapticRate / physics_hz);
    std::vector<FakeDriver*> fakes;
    std::vector<device::Device> opened;
    for (int k = 0; k < 2; ++k) {
      auto driver = std::make_unique<FakeDriver>();
      fakes.push_back(driver.get());
      opened.emplace_back(std::move(driver));
    }
    Hands hands(testing::pinched_limb(), h);
    DeviceHands devices(std::move(opened), {});
    devices.place_around(hands);
    const double away = testing::kLimbRadius + kFingertipRadius;
    for (const int k : {0, 1}) {
      const double side = k == 0 ? 1.0 : -1.0;
      hands.set_scale(k, 1.0);
      hands.set_base(k, {.position = Eigen::Vector3d(0, side * away, 1)});
      fakes[k]->reading.position.y() = side * kClearance;
    }
    devices.serve(ticks, h / ticks, hands);
    double time = 0.0;
    const auto step = [&] {
      devices.begin_step(time, hands);
      ASSERT_EQ(hands.step().status, dynamics::StepStatus::kOk);
      devices.end_step(time, hands);
      time += h;
    };
    const auto pass = [&](double seconds) {
      for (long n = std::lround(seconds * physics_hz); n > 0; --n) step();
    };
    step();
    for (const int k : {0, 1}) {
      hands.touch({.pointer = k, .stiffness = 1000.0});
    }
    // Before the limb has fallen far.
    const int closing = static_cast<int>(kClosing * physics_hz);
    for (int i = 1; i <= closing; ++i) {
      const double gap = kClearance - (kClearance + kSqueeze) * i / closing;
      for (const int k : {0, 1}) fakes[k]->reading.position.y() = (k == 0 ? 1.0 : -1.0) * gap;
      step();
    }
    pass(1.0);
    const dynamics::BodyState& limb = hands.state().bodies[0];
    const Eigen::Quaterniond rotation = limb.rotation;
    const Eigen::Vector3d position = limb.position;
    const auto tilt_to = [&](double angle, double phase) {
      const Eigen::Vector3d axis(std::cos(phase), 0, std::sin(phase));
      for (FakeDriver* fake : fakes) fake->reading.rotation = Eigen::AngleAxisd(angle, axis);
      pass(0.01);
    };
    for (int k = 1; k <= 50; ++k) tilt_to(kTilt * k / 50, 0.0);
    for (int k = 1; k <= 100 * kCircles; ++k) tilt_to(kTilt, 2.0 * std::numbers::pi * k / 100);
    for (int k = 49; k >= 0; --k) tilt_to(kTilt * k / 50, 0.0);
    pass(1.0);
    EXPECT_LT((limb.position - position).norm(), 1e-3);
    EXPECT_LT(limb.rotation.angularDistance(rotation), 0.05);
    for (const int k : {0, 1}) EXPECT_TRUE(hands.pointers().at(k).fingertip()->touched.contact);
  }
}

TEST(HapticLoop, FingertipWithAMagnet_HoldsWhatItTouched) {
  auto driver = std::make_unique<FakeDriver>();
  FakeDriver& fake = *driver;
  fake.tremor = kTremor;
  ServedRig rig(std::move(driver), 250.0, 8, testing::thick_doll());
  rig.pass(1.0);
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(rig.hands.model(), rig.hands.state(), poses);
  const Eigen::Vector3d above = poses[2].com + (testing::kLimbRadius + 0.010) * Eigen::Vector3d::UnitZ();
  rig.devices.guide(0, {.position = above}, rig.hands);
  rig.hands.touch({.pointer = 0, .fingertip = {.magnet = true}});
  const double scale = rig.pointer().map().scale();
  const auto go_to = [&](double height) {
    const double begin = fake.reading.position.z();
    for (int k = 1; k <= 50; ++k) {
      fake.reading.position.z() = begin + (height / scale - begin) * k / 50.0;
      rig.pass(0.02);
    }
    rig.pass(1.0);
  };
  go_to(-0.02);
  ASSERT_TRUE(rig.pointer().fingertip()->bond.has_value());
  go_to(0.03);
  EXPECT_TRUE(rig.pointer().fingertip()->bond.has_value());
  EXPECT_LT(rig.pointer().fingertip()->touched.force.z(), -0.05) << "the limb hangs on the finger";
  EXPECT_LT(fake.told.force.z(), -0.05);
}

TEST(HapticLoop, LateAnswers_AreMadeUpFor) {
  auto driver = std::make_unique<FakeDriver>();
  DeviceSet devices(testing::one_device(std::move(driver)), {});
  HapticLoop loop(devices, 10, 1e-3);
  auto orders = std::make_unique<HapticOrders>();
  auto report = std::make_unique<HapticReport>();
  int intervals = 0;
  for (int k = 0; k < 1000; ++k) {
    const bool late = k % 100 < 35;
    if (!late && (k == 35 || loop.has_report())) {
      if (loop.take(*report)) ++intervals;
      loop.give(*orders);
    }
    loop.tick(1e-3 * k, 1);
  }
  EXPECT_NEAR(intervals, 97, 2) << "as many as if none had been late, but for the first";
}

TEST(HapticLoop, TickAndExchange_AllocateNothing) {
  const auto rig = pulled(100.0, 10);
  const long before = testing::allocation_count();
  for (int k = 0; k < 50; ++k) rig->step();
  EXPECT_EQ(testing::allocation_count(), before);
}

TEST(HapticLoop, Unsound_ExertsNothingAndGoesOn) {
  const auto rig = pulled(100.0, 10);
  ASSERT_GT(rig->pointer().force_on_hand().force.norm(), 0.05);
  for (int k = 0; k < 10; ++k) {
    rig->devices.let_go(rig->time);
    rig->time += rig->h;
  }
  // The pulleys' friction is left.
  EXPECT_LT(rig->driver.exerted().force.norm(), 0.5);
  rig->pass(1.0);
  EXPECT_LT(rig->pointer().force_on_hand().force.z(), -0.05);
}

}  // namespace
}  // namespace layfigure::haptics
