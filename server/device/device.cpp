#include "layfigure/device/device.h"

#include <utility>

namespace layfigure::device {

Device::Device(std::unique_ptr<Driver> driver)
    : driver_(std::move(driver)), guard_(GuardSettings::of(driver_->info())) {}

Device::Device(std::unique_ptr<Driver> driver, const GuardSettings& settings)
    : driver_(std::move(driver)), guard_(settings) {}

Device::~Device() {
  if (driver_ != nullptr) close();
}

Reading Device::read(double time) noexcept { return guard_.check(time, driver_->read(time)); }

Wrench Device::write(double time, const Wrench& wanted) noexcept {
  const Wrench safe = guard_.limit(time, wanted);
  if (!closed_) driver_->write(safe);
  return safe;
}

void Device::close() noexcept {
  guard_.close();
  if (std::exchange(closed_, true)) return;
  driver_->write({});
  driver_->close();
}

void Device::aim(const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) noexcept {
  driver_->aim(position, rotation);
}

}  // namespace layfigure::device
