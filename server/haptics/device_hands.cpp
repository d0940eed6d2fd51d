#include "layfigure/haptics/device_hands.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
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

bool is_squeezed(const DeviceInput::Hand& hand, bool before) {
  return (hand.buttons & kGrabButton) != 0 || hand.grip > (before ? kOpen : kSqueezed);
}

std::vector<device::Info> infos_of(const std::vector<device::Device>& devices) {
  std::vector<device::Info> infos;
  for (const device::Device& device : devices) infos.push_back(device.info());
  return infos;
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

DeviceHands::DeviceHands(std::vector<device::Device> devices, const PassivityOptions& passivity)
    : hands_(devices.size()),
      infos_(infos_of(devices)),
      devices_(std::make_unique<DeviceSet>(std::move(devices), passivity)) {
  input_.hands.resize(hands_.size());
}

DeviceHands::DeviceHands(std::vector<device::Info> infos, std::function<DeviceInput()> next)
    : hands_(infos.size()), infos_(std::move(infos)), next_(std::move(next)) {}

void DeviceHands::place_around(Hands& hands) const {
  const double size = half_size(hands.doll());
  const Eigen::Vector3d middle = skin_box(hands.doll()).center();
  for (int k = 0; k < count(); ++k) {
    const double scale = std::clamp(size / info(k).reach, kMinScale, kMaxScale);
    const double side = count() == 1 ? 0.0 : k % 2 == 0 ? -0.5 : 0.5;
    hands.set_base(k, {.position = middle + side * kHandsApart * size * Eigen::Vector3d::UnitX()});
    hands.set_scale(k, scale);
    hands.set_power_scale(k, usual_power_scale(scale, hands.default_stiffness()));
  }
}

void DeviceHands::guide(int pointer, const PointerPose& world, Hands& hands) {
  Hand& hand = hands_[pointer];
  const Pointer& guided = hands.pointers().at(pointer);
  if (guided.tool() != Tool::kNone) {
    hand.guided = guided.map().to_device(world);
    return;
  }
  hands.place(pointer, world);
  if (!info(pointer).simulated) return;
  hand.placed = world;
  hand.wanted = hand.guided = {};
  hand.glide.stop();
}

void DeviceHands::glide(int pointer, std::int64_t steps) {
  Hand& hand = hands_[pointer];
  hand.glide.start(hand.wanted, hand.guided, steps);
}

void DeviceHands::glide(std::int64_t steps) {
  for (int k = 0; k < count(); ++k) glide(k, steps);
}

void DeviceHands::follow_buttons(Hands& hands) {
  if (empty()) return;
  if (is_replayed()) input_ = next_();
  for (int k = 0; k < count(); ++k) {
    Hand& hand = hands_[k];
    DeviceInput::Hand& input = input_.hands[k];
    if (!is_replayed()) {
      input.buttons = hand.seen.reading.buttons;
      input.grip = hand.seen.reading.grip;
    }
    const bool squeezed = is_squeezed(input, hand.squeezed);
    const bool clutched = (input.buttons & kClutchButton) != 0;
    if (squeezed && !hand.squeezed) grab_what_is_near(k, hands);
    if (!squeezed && hand.squeezed && hands.pointers().at(k).tool() == Tool::kGrab) hands.release(k);
    if (clutched != hand.clutched) hands.set_clutch(k, clutched);
    hand.squeezed = squeezed;
    hand.clutched = clutched;
  }
}

void DeviceHands::note_hands() {
  input_.arrived = true;
  for (int k = 0; k < count(); ++k) {
    input_.hands[k].has_hand = hands_[k].seen.has_hand;
    input_.hands[k].hand = hands_[k].seen.hand;
  }
}

/// The pointers are where their hands were last seen.
void DeviceHands::move_pointers(Hands& hands) {
  for (int k = 0; k < count(); ++k) {
    Hand& hand = hands_[k];
    if (input_.hands[k].has_hand) hands.receive(k, input_.hands[k].hand);
    if (hands.pointers().at(k).tool() != Tool::kNone) hand.placed.reset();
    if (hand.placed) {
      hands.place(k, *hand.placed);
    } else {
      hands.follow(k);
    }
  }
}

void DeviceHands::begin_step(double time, Hands& hands) {
  if (empty()) return;
  if (is_served() && !threaded_) give(hands);
  if (!is_replayed() && is_served()) collect(time);
  if (!is_replayed() && !is_served()) read(time);
  if (!input_.arrived) return;
  if (is_served()) {
    if (is_replayed()) recall_report();
    hands.take(*report_);
  }
  move_pointers(hands);
}

void DeviceHands::read(double time) {
  begun_ns_ = now_ns();
  for (int k = 0; k < count(); ++k) {
    Hand& hand = hands_[k];
    if (hand.glide.moving()) hand.wanted = hand.glide.advance();
    devices_->aim(k, hand.wanted);
  }
  devices_->read(time);
  for (int k = 0; k < count(); ++k) hands_[k].seen = devices_->seen(k);
  note_hands();
}

void DeviceHands::end_step(double time, Hands& hands) {
  if (threaded_) give(hands);
  if (is_served() || !devices_) return;
  for (int k = 0; k < count(); ++k) {
    const Pointer& pointer = hands.pointers().at(k);
    const dynamics::BodyForce felt = pointer.force_on_hand();
    devices_->render(k, {.force = felt.force, .torque = felt.torque}, pointer.tool() != Tool::kNone);
  }
  devices_->exert(time, hands.step_length());
  for (int k = 0; k < count(); ++k) hands_[k].seen = devices_->seen(k);
  record_tick(time, hands.step_length());
}

void DeviceHands::record_tick(double time, double step) {
  const double periods = record_.ticks > 0 ? std::round((time - last_time_) / step) : 1.0;
  last_time_ = time;
  record_.add(1e-9 * static_cast<double>(now_ns() - begun_ns_), std::max(static_cast<int>(periods), 1));
  window_.update(record_, time);
}

void DeviceHands::let_go(double time) {
  if (!loop_) {
    if (devices_) devices_->let_go(time);
    return;
  }
  orders_->sound = orders_->has_model = false;
  loop_->give(*orders_);
  if (!thread_) run_ticks(time);
  (void)loop_->take(*report_);
  for (int k = 0; k < count(); ++k) hands_[k].seen = report_->devices[k];
}

// ---------------------------------------------------------------- more than one tick in a step

void DeviceHands::serve(int ticks, double tick, Hands& hands) {
  ticks_ = ticks;
  tick_ = tick;
  if (devices_) loop_ = std::make_unique<HapticLoop>(*devices_, ticks, tick);
  orders_ = std::make_unique<HapticOrders>();
  report_ = std::make_unique<HapticReport>();
  input_.loads.reserve(kMostPorts);
  input_.tools.reserve(kMostPointers);
  hands.serve(count());
}

void DeviceHands::start_thread(Hands& hands) {
  threaded_ = true;
  give(hands);
  if (is_replayed()) return;
  const double h = tick_;
  thread_ = std::make_unique<RealtimeThread>(1.0 / h, [loop = loop_.get(), h](double passed) {
    const double now = 1e-9 * static_cast<double>(now_ns());
    loop->tick(now, static_cast<int>(std::lround(passed / h)));
  });
}

/// What physics has to tell the ticks to come. A replay makes the local model as well: that changes what acts.
void DeviceHands::give(Hands& hands) {
  orders_->sound = true;
  orders_->has_model = hands.make_local_model(tick_, orders_->model);
  if (is_replayed()) return;
  for (int k = 0; k < count(); ++k) {
    Hand& hand = hands_[k];
    if (hand.glide.moving()) hand.wanted = hand.glide.advance();
    const Pointer& pointer = hands.pointers().at(k);
    ServedHand& served = orders_->hands[k];
    served.has_tool = pointer.tool() != Tool::kNone;
    served.map = pointer.map();
    served.wanted = hand.wanted;
    if (!served.has_tool) continue;
    served.position_offset = pointer.grip()->position_offset;
    served.rotation_offset = pointer.grip()->rotation_offset;
  }
  loop_->give(*orders_);
}

void DeviceHands::run_ticks(double time) {
  for (int i = 0; i < loop_->ticks(); ++i) loop_->tick(time + i * loop_->tick_length(), 1);
}

/// What the step's ticks, or the thread's, have done.
void DeviceHands::collect(double time) {
  if (!thread_) run_ticks(time);
  input_.arrived = loop_->take(*report_);
  if (!input_.arrived) return;
  for (int k = 0; k < count(); ++k) hands_[k].seen = report_->devices[k];
  window_.update(report_->ticks, time);
  note_hands();
  input_.loads.assign(report_->loads.begin(), report_->loads.begin() + report_->load_count);
  input_.tools.assign(report_->tools.begin(), report_->tools.end());
}

/// The report that the replayed input came from, as far as steps depend on it.
void DeviceHands::recall_report() {
  report_->load_count = static_cast<int>(input_.loads.size());
  std::ranges::copy(input_.loads, report_->loads.begin());
  std::ranges::copy(input_.tools, report_->tools.begin());
}

}  // namespace layfigure::haptics
