#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "fake_device.h"
#include "layfigure/device/open.h"
#include "layfigure/haptics/device_hands.h"
#include "small_doll.h"

/// A doll and a device that is served between its steps.
namespace layfigure::testing {

constexpr int kTip = 3;           // the bone at the end of the small doll's arm
constexpr double kTremor = 1e-6;  // [m], of hands that are pushed while they stand still

/// A doll with a device at pointer 0, in lockstep.
struct ServedRig {
  ServedRig(std::unique_ptr<device::Driver> opened, double physics_hz, int ticks, doll::Doll doll = small_doll())
      : driver(*opened),
        hands(std::move(doll), 1.0 / physics_hz),
        devices(one_device(std::move(opened))),
        h(1.0 / physics_hz) {
    devices.place_around(hands);
    if (ticks > 1) devices.serve(ticks, h / ticks, hands);
  }

  void step() {
    devices.follow_buttons(hands);
    devices.begin_step(time, hands);
    ASSERT_EQ(hands.step().status, dynamics::StepStatus::kOk);
    devices.end_step(time, hands);
    time += h;
  }
  void pass(double seconds) {
    for (long n = std::lround(seconds / h); n > 0; --n) step();
  }
  [[nodiscard]] const haptics::Pointer& pointer() const { return hands.pointers().at(0); }
  [[nodiscard]] Eigen::Vector3d tip() const {
    std::vector<dynamics::BodyPose> poses;
    dynamics::world_poses(hands.model(), hands.state(), poses);
    const doll::Carrier& carrier = hands.doll().carriers[kTip];
    return poses[carrier.body].origin + poses[carrier.body].rotation * carrier.pose.translation();
  }

  device::Driver& driver;
  haptics::Hands hands;
  haptics::DeviceHands devices;
  double h;
  double time{0.0};
};

/// The simulated hand holds the tip and goes up.
inline void pull_up(ServedRig& rig) {
  const Eigen::Vector3d tip = rig.tip();
  rig.devices.guide(0, {.position = tip}, rig.hands);
  rig.hands.grab({.pointer = 0, .bone = kTip});
  rig.devices.guide(0, {.position = tip + 0.05 * Eigen::Vector3d::UnitZ()}, rig.hands);
  rig.devices.glide(0, std::lround(0.5 / rig.h));
  rig.pass(1.5);
}

/// On slow physics.
inline std::unique_ptr<ServedRig> pulled(double physics_hz, int ticks) {
  auto rig = std::make_unique<ServedRig>(device::open_driver({.kind = "spidar-g6x3"}), physics_hz, ticks);
  rig->pass(0.1);
  pull_up(*rig);
  return rig;
}

}  // namespace layfigure::testing
