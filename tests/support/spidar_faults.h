#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

#include "layfigure/spidar/simulated_device.h"

/// All that can go wrong with a simulated SPIDAR.
namespace layfigure::testing {

struct SpidarFault {
  const char* name;
  void (*begin)(spidar::SimulatedFaults& faults, const spidar::SimulatedSpidar& device);
  bool at_once{true};  ///< the lengths show it at the next tick; else when the grip has moved
  double lasts{1e9};   ///< [s] for how long a guard does not believe the device
};

/// A pose elsewhere, whose lengths fit as well as the true ones.
inline void jump(spidar::SimulatedFaults& faults, const spidar::SimulatedSpidar& device) {
  spidar::Pose elsewhere = device.grip();
  elsewhere.position += Eigen::Vector3d(-0.02, 0.015, 0.01);
  faults.errors = string_lengths(device.geometry(), elsewhere) - string_lengths(device.geometry(), device.grip());
}

inline const std::vector<SpidarFault>& spidar_faults() {
  using Faults = spidar::SimulatedFaults;
  using Device = spidar::SimulatedSpidar;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  static const std::vector<SpidarFault> kFaults{
      {"broken string", [](Faults& faults, const Device&) { faults.broken_string = 3; }},
      {"dead motor", [](Faults& faults, const Device&) { faults.dead_motor = 5; }, false},
      {"stuck encoder", [](Faults& faults, const Device&) { faults.stuck_encoder = 2; }, false},
      {"lost messages", [](Faults& faults, const Device&) { faults.silent = true; }},
      {"string that slipped", [](Faults& faults, const Device&) { faults.errors[6] = 2e-3; }},
      {"string that is too short", [](Faults& faults, const Device&) { faults.errors[0] = -2e-3; }},
      {"zero of another device",
       [](Faults& faults, const Device&) { faults.errors << 3e-3, -2e-3, 1e-3, 4e-3, -1e-3, 2e-3, -3e-3, 1e-3; }},
      {"length that is no number", [](Faults& faults, const Device&) { faults.errors[1] = kNan; }},
      {"length without end", [](Faults& faults, const Device&) { faults.errors[7] = INFINITY; }},
      {"lengths beyond the frame", [](Faults& faults, const Device&) { faults.errors.setConstant(1.0); }},
      {"negative lengths", [](Faults& faults, const Device&) { faults.errors.setConstant(-1.0); }},
      {"jump", jump, true, 0.05},
  };
  return kFaults;
}

}  // namespace layfigure::testing
