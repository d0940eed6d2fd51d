#pragma once

#include <memory>
#include <vector>

#include "layfigure/device/device.h"

namespace layfigure::testing {

/// A device whose readings a test sets.
class FakeDriver : public device::Driver {
 public:
  FakeDriver() {
    info_.name = "fake";
    info_.max_force = 10.0;
    info_.max_torque = 1.0;
    info_.reach = 0.1;
    reading.status = device::Reading::Status::kOk;
  }
  [[nodiscard]] const device::Info& info() const noexcept override { return info_; }
  [[nodiscard]] device::Reading read(double now) noexcept override {
    time = now;
    device::Reading told_now = reading;
    tremor = -tremor;
    told_now.position.x() += tremor;
    return told_now;
  }
  void write(const device::Wrench& wrench) noexcept override {
    told = wrench;
    if (!wrench.is_zero()) pushed_at = time;
  }
  [[nodiscard]] device::Wrench exerted() const noexcept override { return told; }
  void close() noexcept override { told = {}; }

  device::Reading reading;
  device::Wrench told;
  double time{0.0};       ///< [s] of the last tick
  double pushed_at{0.0};  ///< [s] the last tick in which it was told of a force
  double tremor{0.0};     ///< [m] to either side: a guard takes a hand without any under a push for a frozen device

 private:
  device::Info info_;
};

/// One device of a driver, which stays the caller's to look at.
[[nodiscard]] inline std::vector<device::Device> one_device(std::unique_ptr<device::Driver> driver) {
  std::vector<device::Device> devices;
  devices.emplace_back(std::move(driver));
  return devices;
}

}  // namespace layfigure::testing
