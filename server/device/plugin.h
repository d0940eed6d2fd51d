#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "layfigure/device/device.h"

namespace layfigure::device {

/// Loads a plugin of plugins/device/layfigure_device.h and opens its device. `config`: its own, may be empty. Throws
/// DeviceError: no such file, no shared object, no layfigure_device_plugin() in it, another version, a function that is
/// NULL, a device that does not open, an info that cannot be.
[[nodiscard]] std::unique_ptr<Driver> open_plugin(const std::filesystem::path& path, const std::string& config);

}  // namespace layfigure::device
