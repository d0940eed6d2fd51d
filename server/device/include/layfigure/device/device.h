#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "layfigure/device/guard.h"
#include "layfigure/device/types.h"

/// What the server sees of a haptic device: a grip that is somewhere, and that can be pushed.
namespace layfigure::device {

/// A device that cannot be used. what() is one line that names the device or file, the value and the mend.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a device is driven by: the simulated SPIDAR, the LCM bridge, a plugin. It does as it is told; nothing is
/// checked or limited here, see Device. `time` [s] is that of whoever drives it: of the wall clock, or of a simulation
/// in lockstep; it never runs backwards.
///
/// read() and write() are called by one thread, at each haptic tick: they neither wait nor allocate.
class Driver {
 public:
  virtual ~Driver() = default;

  [[nodiscard]] virtual const Info& info() const noexcept = 0;
  [[nodiscard]] virtual Reading read(double time) noexcept = 0;
  /// Lasts until the next one. What the device cannot do is cut; of what is not finite nothing is exerted.
  virtual void write(const Wrench& wrench) noexcept = 0;
  /// What it exerts, or was last told to.
  [[nodiscard]] virtual Wrench exerted() const noexcept = 0;
  /// Lets go for good: no force from now on. Called once, before the destructor.
  virtual void close() noexcept = 0;
  /// Where the hand wants the grip to be, for a device that is simulated with its hand; others have a hand of their
  /// own.
  virtual void aim(const Eigen::Vector3d& /*position*/, const Eigen::Quaterniond& /*rotation*/) noexcept {}
};

/// A driver behind its guard (guard.h): only poses that can be believed come out of it, only forces that are safe go
/// in.
///
/// For one thread. read() and write() allocate, lock, log and throw nothing. The destructor closes.
class Device {
 public:
  explicit Device(std::unique_ptr<Driver> driver);
  Device(std::unique_ptr<Driver> driver, const GuardSettings& settings);
  ~Device();
  Device(Device&&) = default;
  Device& operator=(Device&&) = delete;

  [[nodiscard]] const Info& info() const noexcept { return driver_->info(); }
  /// kOk: a pose that can be used. Otherwise the last such pose, and why there is no newer one.
  [[nodiscard]] Reading read(double time) noexcept;
  /// Exerts `wanted` on the hand as far as it is safe. Returns what is exerted. To be called at each tick: without it
  /// the guard notices nothing.
  Wrench write(double time, const Wrench& wanted) noexcept;
  /// See Guard::fail(); before write().
  void fail(Fault fault) noexcept { guard_.fail(fault); }
  void close() noexcept;
  void aim(const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) noexcept;

  [[nodiscard]] const GuardReport& report() const noexcept { return guard_.report(); }
  [[nodiscard]] Driver& driver() noexcept { return *driver_; }

 private:
  std::unique_ptr<Driver> driver_;
  Guard guard_;
  bool closed_{false};
};

}  // namespace layfigure::device
