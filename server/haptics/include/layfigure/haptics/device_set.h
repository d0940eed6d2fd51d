#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "layfigure/device/device.h"
#include "layfigure/haptics/passivity.h"
#include "layfigure/haptics/pointer_pose.h"

namespace layfigure::haptics {

/// What was last seen of a device.
struct DeviceSeen {
  device::Reading reading;     ///< the newest, whatever its status
  PointerPose hand;            ///< the newest pose that could be believed, in the device's frame
  bool has_hand{false};        ///< there was one
  device::GuardReport report;  ///< of its guard
  double energy{0.0};          ///< E of the passivity observer [J]: what the hand put in since its tool came out
};

/// The haptic devices as one tick sees them: all are read, and all exert what is rendered, through the passivity
/// controller and each one's guard.
///
/// For one thread. Allocates in its constructor only; locks, logs and throws nothing.
class DeviceSet {
 public:
  DeviceSet(std::vector<device::Device> devices, const PassivityOptions& passivity);

  [[nodiscard]] int count() const { return static_cast<int>(entries_.size()); }
  [[nodiscard]] const device::Device& device(int index) const { return entries_[index].device; }
  [[nodiscard]] const DeviceSeen& seen(int index) const { return entries_[index].seen; }

  /// Where the hand of a simulated device wants to be from now on, in the device's frame.
  void aim(int index, const PointerPose& wanted) noexcept;
  /// `time` [s]: see device::Driver.
  void read(double time) noexcept;
  /// What the hand of device `index` is to feel in the tick: in the device's frame; without a tool nothing.
  void render(int index, const device::Wrench& wanted, bool has_tool) noexcept;
  /// Exerts what was rendered since the last read(). T: of the tick [s], > 0.
  void exert(double time, double T) noexcept;
  /// Exerts nothing.
  void let_go(double time) noexcept;
  /// Of all devices, see device::Guard::fail(); before exert().
  void fail(device::Fault fault) noexcept;

 private:
  struct Entry {
    device::Device device;
    DeviceSeen seen;
    bool has_tool{false};
  };

  std::vector<Entry> entries_;
  std::vector<PassivityPort> ports_;
  Passivity passivity_;
};

}  // namespace layfigure::haptics
