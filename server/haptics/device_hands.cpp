#include "layfigure/haptics/device_hands.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <utility>

namespace layfigure::haptics {
namespace {

// A hand that opens a little does not let go, nor does one that closes a little grab.
constexpr double kSqueezed = 0.6;
constexpr double kOpen = 0.4;
constexpr std::uint32_t kGrabButton = 1U << 0U;
constexpr std::uint32_t kClutchButton = 1U << 1U;
// How far from each other two hands begin, beside the doll's half size.
constexpr double kHandsApart = 0.5;
// How far a squeezing hand reaches, beside the doll's half size.
constexpr double kReachShare = 0.05;

/// The skin's box in the bind pose, world.
Eigen::AlignedBox3d skin_box(const doll::Doll& doll) {
  Eigen::AlignedBox3d box;
  for (const character::SkinnedMesh& mesh : doll.rig.meshes) {
    for (const Eigen::Vector3d& vertex : mesh.vertices) box.extend(vertex);
  }
  return box;
}

double half_size(const doll::Doll& doll) { return 0.5 * skin_box(doll).sizes().maxCoeff(); }

double usual_power_scale(double scale, double grip_stiffness) {
  return std::clamp(kFeltStiffness / (scale * scale * grip_stiffness), kMinPowerScale, kMaxPowerScale);
}

bool is_squeezed(const device::Reading& reading, bool before) {
  return (reading.buttons & kGrabButton) != 0 || reading.grip > (before ? kOpen : kSqueezed);
}

void grab_what_is_near(int pointer, Hands& hands) {
  try {
    const double reach = std::max(kGrabReach, kReachShare * half_size(hands.doll()));
    const skinning::SkinPoint near = hands.skin_near(pointer, reach);
    if (hands.pointers().at(pointer).tool() != Tool::kNone) hands.release(pointer);
    hands.grab({.pointer = pointer, .bone = near.bone, .point = near.p_BS});
  } catch (const std::invalid_argument&) {
    // The hand has closed on air, or on what cannot be held.
  }
}

}  // namespace

DeviceHands::DeviceHands(std::vector<device::Device> devices) {
  devices_.reserve(devices.size());
  for (device::Device& device : devices) devices_.push_back({.device = std::move(device)});
}

void DeviceHands::place_around(Hands& hands) const {
  const double size = half_size(hands.doll());
  const Eigen::Vector3d middle = skin_box(hands.doll()).center();
  for (int k = 0; k < count(); ++k) {
    const double scale = std::clamp(size / device(k).info().reach, kMinScale, kMaxScale);
    const double side = count() == 1 ? 0.0 : k % 2 == 0 ? -0.5 : 0.5;
    hands.set_base(k, {.position = middle + side * kHandsApart * size * Eigen::Vector3d::UnitX()});
    hands.set_scale(k, scale);
    hands.set_power_scale(k, usual_power_scale(scale, hands.default_stiffness()));
  }
}

void DeviceHands::guide(int pointer, const PointerPose& world, Hands& hands) {
  Hand& hand = devices_[pointer];
  const Pointer& guided = hands.pointers().at(pointer);
  if (guided.tool() != Tool::kNone) {
    hand.guided = guided.map().to_device(world);
    return;
  }
  hands.place(pointer, world);
  if (!hand.device.info().simulated) return;
  hand.placed = world;
  hand.wanted = hand.guided = {};
  hand.glide.stop();
}

void DeviceHands::glide(int pointer, std::int64_t steps) {
  Hand& hand = devices_[pointer];
  hand.glide.start(hand.wanted, hand.guided, steps);
}

void DeviceHands::glide(std::int64_t steps) {
  for (int k = 0; k < count(); ++k) glide(k, steps);
}

void DeviceHands::follow_buttons(Hands& hands) {
  for (int k = 0; k < count(); ++k) {
    Hand& hand = devices_[k];
    const bool squeezed = is_squeezed(hand.reading, hand.squeezed);
    const bool clutched = (hand.reading.buttons & kClutchButton) != 0;
    if (squeezed && !hand.squeezed) grab_what_is_near(k, hands);
    if (!squeezed && hand.squeezed && hands.pointers().at(k).tool() == Tool::kGrab) hands.release(k);
    if (clutched != hand.clutched) hands.set_clutch(k, clutched);
    hand.squeezed = squeezed;
    hand.clutched = clutched;
  }
}

void DeviceHands::begin_step(double time, Hands& hands) {
  for (int k = 0; k < count(); ++k) {
    Hand& hand = devices_[k];
    if (hand.glide.moving()) hand.wanted = hand.glide.advance();
    hand.device.aim(hand.wanted.position, hand.wanted.rotation);
    hand.reading = hand.device.read(time);
    if (hand.reading.status == device::Reading::Status::kOk) {
      hands.receive(k, {.position = hand.reading.position, .rotation = hand.reading.rotation});
    }
    if (hands.pointers().at(k).tool() != Tool::kNone) hand.placed.reset();
    if (hand.placed) {
      hands.place(k, *hand.placed);
    } else {
      hands.follow(k);
    }
  }
}

void DeviceHands::end_step(double time, const Hands& hands) {
  for (int k = 0; k < count(); ++k) {
    const dynamics::BodyForce felt = hands.pointers().at(k).force_on_hand();
    devices_[k].device.write(time, {.force = felt.force, .torque = felt.torque});
  }
}

void DeviceHands::let_go(double time) {
  for (Hand& hand : devices_) hand.device.write(time, {});
}

}  // namespace layfigure::haptics
