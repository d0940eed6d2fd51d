#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "layfigure/device/device.h"

namespace layfigure::device {

/// What --device and --device-config name.
struct OpenSettings {
  std::string kind;                ///< see open_driver()
  std::filesystem::path config{};  ///< empty: none
  int index{0};                    ///< of how many devices were opened before
  std::string bus_url{};           ///< of LCM, for "lcm"
  std::string channel_prefix{};    ///< likewise
};

/// Opens a device:
/// - "spidar-g6": a simulated SPIDAR with its hand. config: a geometry file (spidar/geometry.h); without one a
///   SPIDAR-G6X3. "spidar-g6x3", "spidar-g6x4", "spidar-g6x5": the project's own geometries, which are built in.
/// - "lcm": a device whose process speaks SPIDAR_STATE and SPIDAR_COMMAND. config: a TOML file, all of it optional,
///       device_id = "left"          # which one it is; without it "0" for the first device, "1" for the second, ..
///       geometry = "my.toml"        # of a SPIDAR that tells lengths, relative to this file, or a name as above
///       max_force = 3.0             # [N], of a device that tells poses; 0 if it cannot push
///       max_torque = 0.1            # [N m]
///       reach = 0.1                 # [m]
///       reach_angle = 0.7           # [rad]
///   of which the last four are known from a geometry.
/// - PATH.so: a plugin (plugins/device/layfigure_device.h). config: its own.
///
/// Throws DeviceError, spidar::GeometryError or messaging::BusError.
[[nodiscard]] std::unique_ptr<Driver> open_driver(const OpenSettings& settings);

/// The same behind its guard.
[[nodiscard]] Device open_device(const OpenSettings& settings);

/// Whether `kind` is one that open_driver() knows, "none" not being one of them.
[[nodiscard]] bool is_device_kind(std::string_view kind);

}  // namespace layfigure::device
