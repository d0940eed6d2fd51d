// Whatever a device does, the force on the hand is none in time: every fault, tick by tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "layfigure/device/open.h"
#include "layfigure/device/simulated_spidar.h"
#include "spidar_faults.h"
#include "time_to_no_force.h"

namespace layfigure::device {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::SpidarFault;

constexpr double kDeadline = 10e-3;  // [s] from when a fault shows to no force
constexpr double kWatched = 0.3;     // [s] after it
// Where an encoder is off by less nothing shows: some tens of counts, of which the six that the pose takes up hide
// most.
constexpr double kShows = 1e-3;  // [m]
// What the strings pull with where no force is asked for [N]: 0.3 each so as not to sag, which the others do not
// balance where one is missing, and the friction of eight pulleys, 0.05 each; and some of the motors' lags [s].
constexpr double kNoForce = 1.2;
constexpr double kLag = 2e-3;
const Wrench kPush{.force = {2.0, 3.0, -2.0}, .torque = {0.01, -0.02, 0.0}};

/// A simulated device that is watched like a real one.
Device watched_device() {
  auto driver = open_driver({.kind = "spidar-g6", .config = {}, .index = 0, .bus_url = {}, .channel_prefix = {}});
  GuardSettings settings = GuardSettings::of(driver->info());
  settings.still_time = GuardSettings::kStillTime;
  return Device(std::move(driver), settings);
}

/// A hand that moves a device about while it is pushed.
class Ticked {
 public:
  explicit Ticked(double rate_hz)
      : device_(watched_device()), driver_(dynamic_cast<SimulatedSpidarDriver&>(device_.driver())), h_(1.0 / rate_hz) {}

  void tick(const Wrench& wanted = kPush) {
    time_ += h_;
    const double phase = 2.0 * std::numbers::pi * 1.5 * time_;
    device_.aim(0.02 * Vector3d(std::sin(phase), std::cos(0.9 * phase), std::sin(1.2 * phase)),
                Quaterniond(Eigen::AngleAxisd(0.2 * std::sin(phase), Vector3d::UnitX())));
    before_ = string_lengths(driver_.spidar().geometry(), driver_.spidar().grip());
    (void)device_.read(time_);
    sent_ = device_.write(time_, wanted);
  }
  void run(double seconds) {
    for (long k = std::lround(seconds / h_); k > 0; --k) tick();
  }
  void pause(double seconds) { time_ += seconds; }

  /// The lengths that were told last are not those of the grip.
  [[nodiscard]] bool shows() const {
    const auto told = driver_.spidar().read();
    return !told || !((*told - before_).cwiseAbs().maxCoeff() < kShows);
  }
  [[nodiscard]] const Wrench& sent() const { return sent_; }
  [[nodiscard]] double exerted() const { return driver_.exerted().force.norm(); }
  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] double tick_length() const { return h_; }
  [[nodiscard]] GuardReport report() const { return device_.report(); }
  spidar::SimulatedFaults& faults() { return driver_.faults(); }
  [[nodiscard]] const spidar::SimulatedSpidar& spidar() const { return driver_.spidar(); }

 private:
  Device device_;
  SimulatedSpidarDriver& driver_;
  double h_;
  double time_{0.0};
  spidar::Lengths before_{spidar::Lengths::Zero()};
  Wrench sent_;
};

void expect_no_force_in_time(double rate_hz, const SpidarFault& fault) {
  Ticked ticked(rate_hz);
  ticked.run(0.8);
  ASSERT_EQ(ticked.report().fault, Fault::kNone);
  ASSERT_GT(ticked.sent().force.norm(), 3.0);
  fault.begin(ticked.faults(), ticked.spidar());
  const double begin = ticked.time();
  double shown = fault.at_once ? begin : INFINITY;
  double none = begin;  // from when on there was no force
  double before = ticked.sent().force.norm();
  const double watched = std::min(kWatched, fault.lasts - 2.0 * ticked.tick_length());
  while (ticked.time() < begin + watched) {
    ticked.tick();
    if (ticked.shows()) shown = std::min(shown, ticked.time());
    const double since = ticked.time() - shown;
    ASSERT_TRUE(ticked.sent().is_finite());
    if (ticked.report().fault != Fault::kNone) {
      ASSERT_LE(ticked.sent().force.norm(), before) << "it falls, " << since << " s after the fault";
    }
    before = ticked.sent().force.norm();
    if (!ticked.sent().is_zero()) none = ticked.time() + ticked.tick_length();
    if (since < kDeadline) continue;
    ASSERT_TRUE(ticked.sent().is_zero()) << ticked.sent().force.transpose() << ", " << since << " s after the fault";
    if (since > kDeadline + kLag) {
      ASSERT_LT(ticked.exerted(), kNoForce) << since << " s after the fault";
    }
  }
  EXPECT_LT(shown, begin + watched - kDeadline) << "it was there to be seen";
  EXPECT_NE(ticked.report().fault, Fault::kNone);
  testing::tell_time_to_no_force(fault.name + (" at " + std::to_string(std::lround(rate_hz)) + " Hz"), none - shown);
  ticked.faults() = {};
  ticked.run(0.8);
  EXPECT_EQ(ticked.report().fault, Fault::kNone) << "and all is well again";
  EXPECT_GT(ticked.sent().force.norm(), 3.0);
}

TEST(DeviceFaults, EveryFaultOfASpidar_NoForceWithinTenMillisecondsTickByTick) {
  for (const double rate_hz : {1000.0, 4000.0}) {
    for (const SpidarFault& fault : testing::spidar_faults()) {
      SCOPED_TRACE(std::string(fault.name) + " at " + std::to_string(rate_hz) + " Hz");
      expect_no_force_in_time(rate_hz, fault);
    }
  }
}

TEST(DeviceFaults, EncodersThatAllStandStill_TheForceIsBoundedAndGoesWithinASecond) {
  // Eight lengths that stand still may be those of a hand that does: what tells is that it does not give way.
  Ticked ticked(1000.0);
  ticked.run(1.0);
  ticked.faults().frozen = true;
  const double begin = ticked.time();
  while (ticked.time() < begin + 1.5) {
    ticked.tick();
    EXPECT_LE(ticked.sent().force.norm(), kPush.force.norm() * (1.0 + 1e-12));
    if (ticked.time() - begin > 0.8) {
      ASSERT_TRUE(ticked.sent().is_zero());
    }
  }
  EXPECT_EQ(ticked.report().fault, Fault::kFrozen);
  // They are not when they go on from somewhere else.
  ticked.faults().frozen = false;
  ticked.run(1.0);
  EXPECT_EQ(ticked.report().fault, Fault::kNone);
  EXPECT_GT(ticked.sent().force.norm(), 3.0);
}

TEST(DeviceFaults, HandThatStandsStill_KeepsItsForce) {
  // Without any tremor, which no hand is: what moves it is that the force falls, by less than the pulleys' friction.
  constexpr double kFriction = 0.4;  // [N] of eight pulleys
  for (const double rate_hz : {1000.0, 4000.0}) {
    for (const double newtons : {0.6, 4.0}) {
      Device device = watched_device();
      const Wrench push{.force = {0.0, newtons, 0.0}, .torque = Vector3d::Zero()};
      double least = INFINITY;
      for (long k = 1; k < std::lround(10.0 * rate_hz); ++k) {
        const double time = static_cast<double>(k) / rate_hz;
        device.aim(Vector3d::Zero(), Quaterniond::Identity());
        (void)device.read(time);
        const double force = device.write(time, push).force.norm();
        if (time > 1.0) least = std::min(least, force);
      }
      EXPECT_EQ(device.report().trips, 0);
      EXPECT_GE(least, newtons - kFriction);
    }
  }
}

TEST(DeviceFaults, TicksThatComeLate_NoForceAtTheFirstThatIs) {
  for (const double pause : {6e-3, 10e-3, 50e-3, 3.0}) {
    Ticked ticked(1000.0);
    ticked.run(1.0);
    const double before = ticked.sent().force.norm();
    ticked.pause(pause);
    const double begin = ticked.time() - pause;
    const double end = ticked.time() + 0.04;
    ticked.tick();
    double none = ticked.time();
    EXPECT_EQ(ticked.report().fault, Fault::kLate) << pause;
    for (; ticked.time() < end; ticked.tick()) {
      if (!ticked.sent().is_zero()) none = ticked.time() + ticked.tick_length();
      if (ticked.time() - begin >= kDeadline) {
        ASSERT_TRUE(ticked.sent().is_zero()) << pause << ", " << ticked.time() - begin;
      } else {
        ASSERT_LT(ticked.sent().force.norm(), before) << pause;
      }
    }
    const double late = begin + pause + ticked.tick_length();
    testing::tell_time_to_no_force("tick that comes late by " + std::to_string(pause) + " s", none - late);
  }
}

TEST(DeviceFaults, WrenchThatIsNone_NoForceWithinTenMillisecondsTickByTick) {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), kEndless, -kEndless}) {
    for (const bool in_torque : {false, true}) {
      Ticked ticked(4000.0);
      ticked.run(1.0);
      Wrench wrench = kPush;
      (in_torque ? wrench.torque : wrench.force).y() = bad;
      const double begin = ticked.time();
      double none = begin;
      while (ticked.time() < begin + 0.1) {
        ticked.tick(wrench);
        ASSERT_TRUE(ticked.sent().is_finite());
        if (!ticked.sent().is_zero()) none = ticked.time() + ticked.tick_length();
        if (ticked.time() - begin >= kDeadline) {
          ASSERT_TRUE(ticked.sent().is_zero()) << bad;
        }
      }
      testing::tell_time_to_no_force("wrench of " + std::to_string(bad), none - begin);
    }
  }
}

TEST(DeviceFaults, MessagesThatComeAndGo_NoForceWhileMostAreLost) {
  for (const int every : {2, 3, 10}) {
    Ticked ticked(1000.0);
    ticked.run(1.0);
    const double begin = ticked.time();
    for (int k = 0; ticked.time() < begin + kWatched; ++k) {
      ticked.faults().silent = k % every != 0;
      ticked.tick();
      if (ticked.time() - begin >= kDeadline) {
        ASSERT_TRUE(ticked.sent().is_zero()) << every;
      }
    }
  }
}

TEST(DeviceFaults, SecondFaultOnTheFirst_DoesNotPutOffTheEnd) {
  const auto& faults = testing::spidar_faults();
  for (std::size_t first = 0; first < faults.size(); ++first) {
    if (!faults[first].at_once) continue;
    for (const SpidarFault& second : faults) {
      SCOPED_TRACE(std::string(faults[first].name) + ", then " + second.name);
      Ticked ticked(1000.0);
      ticked.run(0.7);
      faults[first].begin(ticked.faults(), ticked.spidar());
      const double begin = ticked.time();
      while (ticked.time() < begin + 0.03) {
        ticked.tick();
        if (ticked.time() - begin > 4.5e-3 && ticked.time() - begin < 5.5e-3) {
          second.begin(ticked.faults(), ticked.spidar());
        }
        if (ticked.time() - begin >= kDeadline) {
          ASSERT_TRUE(ticked.sent().is_zero()) << ticked.time() - begin;
        }
      }
    }
  }
}

}  // namespace
}  // namespace layfigure::device
