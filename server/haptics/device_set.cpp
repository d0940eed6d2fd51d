#include "layfigure/haptics/device_set.h"

#include <utility>

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {

DeviceSet::DeviceSet(std::vector<device::Device> devices, const PassivityOptions& passivity) {
  entries_.reserve(devices.size());
  for (device::Device& device : devices) entries_.push_back({.device = std::move(device), .seen = {}});
  ports_.resize(entries_.size());
  passivity_.configure(passivity);
}

void DeviceSet::aim(int index, const PointerPose& wanted) noexcept {
  entries_[index].device.aim(wanted.position, wanted.rotation);
}

void DeviceSet::read(double time) noexcept {
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    DeviceSeen& seen = entries_[k].seen;
    PassivityPort& port = ports_[k];
    port = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    seen.reading = entries_[k].device.read(time);
    if (seen.reading.status != device::Reading::Status::kOk) continue;
    const PointerPose hand{.position = seen.reading.position, .rotation = seen.reading.rotation};
    if (seen.has_hand) {
      port.displacement = hand.position - seen.hand.position;
      port.turn = math::log_rotation(hand.rotation * seen.hand.rotation.conjugate());
    }
    seen.hand = hand;
    seen.has_hand = true;
  }
}

void DeviceSet::render(int index, const device::Wrench& wanted, bool has_tool) noexcept {
  Entry& entry = entries_[index];
  if (has_tool && !entry.has_tool && index < kMostPointers) passivity_.reset(index);
  entry.has_tool = has_tool;
  ports_[index].force = wanted.force;
  ports_[index].torque = wanted.torque;
}

void DeviceSet::exert(double time, double T) noexcept {
  passivity_.tick(T, ports_);
  for (int k = 0; k < count(); ++k) {
    Entry& entry = entries_[k];
    const device::Wrench wanted =
        entry.has_tool ? device::Wrench{.force = ports_[k].force, .torque = ports_[k].torque} : device::Wrench{};
    const device::Wrench exerted = entry.device.write(time, wanted);
    entry.seen.report = entry.device.report();
    if (k >= kMostPointers) continue;
    passivity_.hold(k, exerted.force, exerted.torque);
    entry.seen.energy = passivity_.ledger(k).energy;
  }
}

void DeviceSet::let_go(double time) noexcept {
  for (int k = 0; k < count(); ++k) {
    Entry& entry = entries_[k];
    (void)entry.device.write(time, {});
    entry.seen.report = entry.device.report();
    entry.has_tool = false;
    if (k < kMostPointers) passivity_.reset(k);
  }
}

void DeviceSet::fail(device::Fault fault) noexcept {
  for (Entry& entry : entries_) entry.device.fail(fault);
}

}  // namespace layfigure::haptics
