#include "layfigure/device/open.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <toml++/toml.h>

#include "builtin_geometries.h"
#include "layfigure/device/simulated_spidar.h"
#include "layfigure/spidar/geometry.h"
#include "lcm_driver.h"
#include "plugin.h"

namespace layfigure::device {
namespace {

constexpr std::string_view kDefaultSpidar = "spidar-g6x3";
constexpr std::string_view kSpidar = "spidar-g6";
constexpr std::string_view kLcm = "lcm";
// A desktop device that nothing more is known of.
constexpr double kUsualForce = 3.0;       // [N]
constexpr double kUsualTorque = 0.1;      // [N m]
constexpr double kUsualReach = 0.1;       // [m]
constexpr double kUsualReachAngle = 0.7;  // [rad]

bool is_plugin(std::string_view kind) { return kind.ends_with(".so"); }

const BuiltinGeometry* find_builtin(std::string_view name) {
  const auto& all = builtin_geometries();
  const auto found = std::ranges::find(all, name == kSpidar ? kDefaultSpidar : name, &BuiltinGeometry::name);
  return found == all.end() ? nullptr : &*found;
}

spidar::Geometry built_in(std::string_view name) {
  const BuiltinGeometry* geometry = find_builtin(name);
  return spidar::parse_geometry(geometry->text, std::string(geometry->name));
}

std::unique_ptr<Driver> open_spidar(const OpenSettings& settings) {
  if (!settings.config.empty() && settings.kind != kSpidar) {
    throw DeviceError(settings.kind + ": it has its geometry; use --device spidar-g6 with " + settings.config.string());
  }
  return std::make_unique<SimulatedSpidarDriver>(settings.config.empty() ? built_in(settings.kind)
                                                                         : spidar::load_geometry(settings.config));
}

/// The config file of an LCM device.
class LcmFile {
 public:
  LcmFile(const std::filesystem::path& path, LcmSettings& settings) : path_(path), settings_(settings) {
    if (!std::filesystem::is_regular_file(path)) refuse("there is no such file; check the path");
    try {
      const toml::table table = toml::parse_file(path.string());
      // The geometry first: what it says of the device, other keys may say otherwise.
      if (const toml::node* node = table.get("geometry")) read_geometry(*node);
      for (const auto& [key, node] : table) read(std::string(key.str()), node);
    } catch (const toml::parse_error& error) {
      refuse("line " + std::to_string(error.source().begin.line) + ": not TOML: " + std::string(error.description()));
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { throw DeviceError(path_.string() + ": " + why); }

  [[nodiscard]] std::string text(const std::string& key, const toml::node& node) const {
    const auto value = node.value<std::string>();
    if (!node.is_string() || value->empty()) refuse(key + ": expected a text");
    return *value;
  }

  [[nodiscard]] double amount(const std::string& key, const toml::node& node) const {
    const auto value = node.value<double>();
    if (!node.is_number() || !(*value >= 0.0) || !std::isfinite(*value)) refuse(key + ": expected a number, 0 or more");
    return *value;
  }

  void read_geometry(const toml::node& node) {
    const std::string name = text("geometry", node);
    settings_.geometry =
        find_builtin(name) != nullptr ? built_in(name) : spidar::load_geometry(path_.parent_path() / name);
    settings_.info = spidar_info(*settings_.geometry);
  }

  void read(const std::string& key, const toml::node& node) {
    if (key == "geometry") return;
    if (key == "device_id") {
      settings_.device_id = text(key, node);
    } else if (key == "max_force") {
      settings_.info.max_force = amount(key, node);
    } else if (key == "max_torque") {
      settings_.info.max_torque = amount(key, node);
    } else if (key == "reach") {
      settings_.info.reach = amount(key, node);
      if (settings_.info.reach == 0.0) refuse("reach: expected a number above 0");
    } else if (key == "reach_angle") {
      settings_.info.reach_angle = amount(key, node);
    } else {
      refuse("unknown key '" + key + "', expected device_id, geometry, max_force, max_torque, reach, reach_angle");
    }
  }

  const std::filesystem::path& path_;
  LcmSettings& settings_;
};

std::unique_ptr<Driver> open_on_bus(const OpenSettings& settings) {
  LcmSettings lcm{.bus = {settings.bus_url, settings.channel_prefix},
                  .device_id = std::to_string(settings.index),
                  .geometry = {},
                  .info = {}};
  lcm.info.max_force = kUsualForce;
  lcm.info.max_torque = kUsualTorque;
  lcm.info.reach = kUsualReach;
  lcm.info.reach_angle = kUsualReachAngle;
  if (!settings.config.empty()) LcmFile(settings.config, lcm);
  lcm.info.name = "LCM device '" + lcm.device_id + "'" + (lcm.geometry ? ", " + lcm.geometry->name : "");
  return open_lcm(lcm);
}

}  // namespace

bool is_device_kind(std::string_view kind) { return kind == kLcm || is_plugin(kind) || find_builtin(kind) != nullptr; }

std::unique_ptr<Driver> open_driver(const OpenSettings& settings) {
  if (settings.kind == kLcm) return open_on_bus(settings);
  if (is_plugin(settings.kind)) return open_plugin(settings.kind, settings.config.string());
  if (find_builtin(settings.kind) != nullptr) return open_spidar(settings);
  throw DeviceError(
      "--device " + settings.kind +
      ": expected none, spidar-g6, spidar-g6x3, spidar-g6x4, spidar-g6x5, lcm or the path of a plugin.so");
}

Device open_device(const OpenSettings& settings) { return Device(open_driver(settings)); }

}  // namespace layfigure::device
