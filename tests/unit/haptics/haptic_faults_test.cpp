// Faults of a device, of its messages or of the physics: no force soon after, and a valid doll.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "layfigure/device/simulated_spidar.h"
#include "layfigure/haptics/haptic_loop.h"
#include "served_rig.h"
#include "spidar_faults.h"
#include "time_to_no_force.h"

namespace layfigure::haptics {
namespace {

using testing::FakeDriver;
using testing::kTip;
using testing::kTremor;
using testing::pulled;
using testing::ServedRig;

constexpr double kSafeWithin = 0.01;  // [s] of a fault to no force

/// Steps of 20 ms until a fault is noticed, and one more.
void expect_no_force_after_the_fault(ServedRig& rig, device::Fault fault) {
  for (int n = 0; n < 25 && rig.devices.seen(0).report.fault == device::Fault::kNone; ++n) rig.step();
  ASSERT_EQ(rig.devices.seen(0).report.fault, fault);
  rig.step();
  EXPECT_EQ(rig.devices.seen(0).report.share, 0.0);
  rig.pass(0.5);
  EXPECT_TRUE(rig.tip().allFinite());
}

TEST(HapticLoop, StringsOrMessagesFail_NoForceAndAValidDoll) {
  for (const std::string fault : {"broken string", "stuck encoder", "lost messages"}) {
    SCOPED_TRACE(fault);
    const auto rig = pulled(50.0, 40);
    ASSERT_EQ(rig->devices.seen(0).report.fault, device::Fault::kNone);
    spidar::SimulatedFaults& faults = dynamic_cast<device::SimulatedSpidarDriver&>(rig->driver).faults();
    if (fault == "broken string") faults.broken_string = 2;
    if (fault == "stuck encoder") faults.stuck_encoder = 3;
    if (fault == "lost messages") faults.silent = true;
    // A stuck encoder is noticed when the grip moves.
    rig->devices.guide(0, {.position = rig->tip() - 0.1 * Eigen::Vector3d::UnitZ()}, rig->hands);
    rig->devices.glide(0, 10);
    expect_no_force_after_the_fault(*rig, fault == "lost messages" ? device::Fault::kGone : device::Fault::kInvalid);
  }
}

/// A simulated SPIDAR that has a fault from a time on, and judges what is asked of it in every tick.
class FaultySpidar : public device::Driver {
 public:
  explicit FaultySpidar(const testing::SpidarFault& fault)
      : driver_(device::open_driver({.kind = "spidar-g6x3"})),
        spidar_(dynamic_cast<Simulated&>(*driver_)),
        fault_(fault) {}

  void begin_at(double time) { begin_ = time; }
  /// The latest that there was a force, after the fault had shown and was still believed [s]; below 0: it did not show.
  [[nodiscard]] double last_force() const { return last_force_; }
  [[nodiscard]] bool has_shown() const { return std::isfinite(shown_); }
  [[nodiscard]] double first_force() const { return first_force_; }

  [[nodiscard]] const device::Info& info() const noexcept override { return driver_->info(); }
  [[nodiscard]] device::Reading read(double time) noexcept override {
    time_ = time;
    if (time >= begin_ && !begun_) {
      begun_ = true;
      first_force_ = force_;
      fault_.begin(spidar_.faults(), spidar_.spidar());
      if (fault_.at_once) shown_ = time;
    }
    const spidar::Lengths before = string_lengths(spidar_.spidar().geometry(), spidar_.spidar().grip());
    const device::Reading reading = driver_->read(time);
    const auto told = spidar_.spidar().read();
    if (begun_ && (!told || !((*told - before).cwiseAbs().maxCoeff() < kShows))) shown_ = std::min(shown_, time);
    return reading;
  }
  void write(const device::Wrench& wrench) noexcept override {
    force_ = wrench.force.norm();
    if (!wrench.is_zero() && time_ < begin_ + fault_.lasts) last_force_ = std::max(last_force_, time_ - shown_);
    driver_->write(wrench);
  }
  [[nodiscard]] device::Wrench exerted() const noexcept override { return driver_->exerted(); }
  void close() noexcept override { driver_->close(); }
  void aim(const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) noexcept override {
    driver_->aim(position, rotation);
  }

 private:
  using Simulated = device::SimulatedSpidarDriver;
  static constexpr double kShows = 1e-3;  // [m]

  std::unique_ptr<device::Driver> driver_;
  Simulated& spidar_;
  const testing::SpidarFault& fault_;
  double begin_{INFINITY};
  double shown_{INFINITY};
  bool begun_{false};
  double time_{0.0};
  double force_{0.0};
  double first_force_{0.0};
  double last_force_{-INFINITY};
};

TEST(HapticLoop, EveryFaultOfASpidarBetweenSteps_NoForceWithinTenMillisecondsTickByTick) {
  constexpr double kPhysicsRate = 50.0;
  for (const testing::SpidarFault& fault : testing::spidar_faults()) {
    SCOPED_TRACE(fault.name);
    auto opened = std::make_unique<FaultySpidar>(fault);
    FaultySpidar& spidar = *opened;
    ServedRig rig(std::move(opened), kPhysicsRate, 40);
    rig.pass(0.1);
    const Eigen::Vector3d tip = rig.tip();
    rig.devices.guide(0, {.position = tip}, rig.hands);
    rig.hands.grab({.pointer = 0, .bone = kTip});
    rig.devices.guide(0, {.position = tip + 0.1 * Eigen::Vector3d::UnitZ()}, rig.hands);
    rig.devices.glide(0, std::lround(1.6 * kPhysicsRate));
    rig.pass(1.0);
    ASSERT_EQ(rig.devices.seen(0).report.fault, device::Fault::kNone);
    spidar.begin_at(rig.time + 7.25e-3);  // in the middle of a step
    rig.pass(0.5);
    EXPECT_GT(spidar.first_force(), 0.01);
    EXPECT_TRUE(spidar.has_shown());
    EXPECT_LT(spidar.last_force(), kSafeWithin);
    testing::tell_time_to_no_force(fault.name, spidar.last_force() + 1.0 / (40.0 * kPhysicsRate));
    EXPECT_NE(rig.devices.seen(0).report.last_fault, device::Fault::kNone);
    EXPECT_TRUE(rig.tip().allFinite());
  }
}

TEST(HapticLoop, PoseIsNotFiniteOrDeviceGone_NoForceWithinTenMilliseconds) {
  constexpr double kTick = 5e-4;
  for (const bool gone : {false, true}) {
    auto opened = std::make_unique<FakeDriver>();
    FakeDriver& fake = *opened;
    fake.tremor = kTremor;
    ServedRig rig(std::move(opened), 100.0, 20);
    rig.pass(1.0);
    rig.devices.guide(0, {.position = rig.tip()}, rig.hands);
    rig.hands.grab({.pointer = 0, .bone = kTip});
    fake.reading.position.z() = 2e-3;
    rig.pass(2.0);
    ASSERT_GT(fake.told.force.norm(), 0.05);
    if (gone) fake.reading.status = device::Reading::Status::kGone;
    if (!gone) fake.reading.position.x() = std::nan("");
    const double begin = fake.time + kTick;  // the first tick that reads it
    rig.pass(kSafeWithin + kTick);
    EXPECT_TRUE(fake.told.is_zero()) << fake.told.force.transpose();
    EXPECT_EQ(rig.devices.seen(0).report.fault, gone ? device::Fault::kGone : device::Fault::kNotFinite);
    testing::tell_time_to_no_force(gone ? "disconnect" : "pose not finite", fake.pushed_at + kTick - begin);
    rig.pass(0.5);
    EXPECT_TRUE(rig.tip().allFinite());
  }
}

/// A loop with a device at which a held doll pulls; physics answers no more.
TEST(HapticLoop, PhysicsStalls_NoForceWithinTenMillisecondsOfItsAnswersTime) {
  constexpr double kTick = 1e-3;
  constexpr int kTicks = 10;
  auto driver = std::make_unique<FakeDriver>();
  FakeDriver& fake = *driver;
  fake.tremor = kTremor;
  Hands hands(testing::small_doll(), kTicks * kTick);
  hands.serve(1);
  DeviceSet devices(testing::one_device(std::move(driver)), {});
  HapticLoop loop(devices, kTicks, kTick);
  hands.set_base(0, {.position = {0.6, 0.0, 1.05}});
  hands.receive(0, {});
  hands.grab({.pointer = 0, .bone = kTip});
  auto orders = std::make_unique<HapticOrders>();
  auto report = std::make_unique<HapticReport>();
  double time = 0.0;
  const auto run_tick = [&] {
    loop.tick(time, 1);
    time += kTick;
  };
  const auto answer = [&] {
    if (loop.take(*report)) {
      hands.take(*report);
      ASSERT_EQ(hands.step().status, dynamics::StepStatus::kOk);
    }
    orders->has_model = hands.make_local_model(kTick, orders->model);
    orders->hands[0] = {.has_tool = true,
                        .map = hands.pointers().at(0).map(),
                        .position_offset = Eigen::Vector3d(0.0, 0.0, 0.03),
                        .wanted = {}};
    loop.give(*orders);
  };
  for (int k = 0; k < 200; ++k) {
    answer();
    while (!loop.has_report()) run_tick();
  }
  ASSERT_GT(fake.told.force.norm(), 0.05);
  const double asked = time;
  while (time < asked + kTicks * kTick) run_tick();
  EXPECT_GT(fake.told.force.norm(), 0.05) << "an answer may take as long as an interval";
  while (time < asked + kTicks * kTick + kSafeWithin) run_tick();
  EXPECT_TRUE(fake.told.is_zero()) << fake.told.force.transpose();
  EXPECT_EQ(devices.seen(0).report.fault, device::Fault::kStalled);
  testing::tell_time_to_no_force("an answer of physics that is due", fake.pushed_at + kTick - (asked + kTicks * kTick));
  for (int k = 0; k < 200; ++k) {
    answer();
    while (!loop.has_report()) run_tick();
  }
  EXPECT_GT(fake.told.force.norm(), 0.05) << "and back when physics is";
  EXPECT_GE(report->ledger.lowest, -1e-3);
}

}  // namespace
}  // namespace layfigure::haptics
