#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "layfigure/device/device.h"
#include "layfigure/haptics/glide.h"
#include "layfigure/haptics/hands.h"

namespace layfigure::haptics {

/// The stiffness of which a grip or fingertip is felt unless told otherwise [N/m]: a third of what an ideal wall may
/// have at 1 kHz with a SPIDAR's encoders, and with the forces of a few newtons that it has as large as a few
/// millimetres.
inline constexpr double kFeltStiffness = 1000.0;

/// Haptic devices as hands: device k moves pointer k, and feels what that exerts.
///
/// At first a pointer stands where the doll's middle is, two of them side by side, its translation scale such that the
/// grip's reach covers the doll. The power scale is such that a grip of the default stiffness k is felt with
/// kFeltStiffness, P s^2 k: a small doll's forces are made larger, a large one's smaller, so that both can be felt and
/// rendered. `set` changes all of it.
///
/// A device that tells how its grip is squeezed, or has buttons, needs nothing else: squeezing (or the first button)
/// grabs the skin that is near, opening lets go; the second button is the clutch.
///
/// A client's messages for such a pointer: while it has no tool they place it, wherever the grip is. With a tool out
/// they tell a simulated device where its hand wants to be; a real one has a hand of its own. A simulated hand that was
/// placed keeps the pointer there, its clutch held so to say, and goes back to the middle of its workspace, until a
/// tool comes out.
///
/// For the thread that steps the doll. begin_step(), end_step() and let_go() allocate, lock, log and throw nothing.
class DeviceHands {
 public:
  DeviceHands() = default;
  explicit DeviceHands(std::vector<device::Device> devices);

  /// Sets the maps of the pointers as said above. Once, before the first step.
  void place_around(Hands& hands) const;

  [[nodiscard]] bool empty() const { return devices_.empty(); }
  [[nodiscard]] int count() const { return static_cast<int>(devices_.size()); }
  [[nodiscard]] bool drives(int pointer) const { return pointer >= 0 && pointer < count(); }
  [[nodiscard]] const device::Device& device(int index) const { return devices_[index].device; }
  /// The device's newest reading.
  [[nodiscard]] const device::Reading& reading(int index) const { return devices_[index].reading; }

  /// A client's wish for where pointer `pointer`, which drives() says is a device's, is to be.
  void guide(int pointer, const PointerPose& world, Hands& hands);
  /// The simulated hand of the pointer, or of all, glides to where it was guided over the next `steps` steps, > 0.
  void glide(int pointer, std::int64_t steps);
  void glide(std::int64_t steps);

  /// What squeezing and buttons ask for. Before begin_step(); allocates where it grabs.
  void follow_buttons(Hands& hands);
  /// Reads the devices and moves their pointers. `time` [s]: see device::Driver.
  void begin_step(double time, Hands& hands);
  /// Exerts on the hands what the step has told.
  void end_step(double time, const Hands& hands);
  /// Exerts nothing: there was no step.
  void let_go(double time);

 private:
  struct Hand {
    device::Device device;
    device::Reading reading;
    PointerPose wanted;  ///< by a simulated hand, in the device's frame ...
    PointerPose guided;  ///< ... and where it is led to
    Glide glide;
    std::optional<PointerPose> placed;  ///< a simulated hand's pointer, until a tool comes out
    bool squeezed{false};
    bool clutched{false};
  };

  std::vector<Hand> devices_;
};

}  // namespace layfigure::haptics
