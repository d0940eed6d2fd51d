#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "layfigure/device/device.h"
#include "layfigure/messaging/bus.h"
#include "layfigure/spidar/geometry.h"

namespace layfigure::device {

struct LcmSettings {
  messaging::BusSettings bus;
  std::string device_id;
  std::optional<spidar::Geometry> geometry;  ///< of a device that tells lengths
  Info info;
};

/// A device on the other side of the bus. Its states come in on the bus's thread, commands go out on one of its own:
/// the haptic tick only puts down the newest command and takes up the newest state. Throws messaging::BusError.
[[nodiscard]] std::unique_ptr<Driver> open_lcm(const LcmSettings& settings);

}  // namespace layfigure::device
