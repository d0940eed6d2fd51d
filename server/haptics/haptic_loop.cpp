#include "layfigure/haptics/haptic_loop.h"

#include <algorithm>

#include "layfigure/haptics/realtime_thread.h"

namespace layfigure::haptics {
HapticLoop::HapticLoop(DeviceSet& devices, int ticks, double tick) : devices_(devices), ticks_(ticks), h_(tick) {}

/// What physics has to say. The hands' maps are new, so their pointers are where these put them: no motion.
void HapticLoop::receive() noexcept {
  const HapticOrders* orders = orders_.take();
  if (orders == nullptr) return;
  answered_ = true;
  sound_ = orders->sound;
  if (orders->has_model) {
    local_.hand_over(orders->model);
    pointers_ = orders->model.pointers;
    pointer_ = orders->model.pointer;
    gains_ = orders->model.gains;
    std::copy_n(orders->model.own.begin(), kMostPointers, is_fingertip_.begin());
  }
  for (int k = 0; k < devices_.count(); ++k) {
    Hand& hand = hands_[k];
    if (orders->hands[k].has_tool != hand.served.has_tool) {
      hand.rate = {};
      hand.soft = {};
      hand.normal.setZero();
    }
    hand.served = orders->hands[k];
    hand.glide.start(hand.aim, hand.served.wanted, ticks_);
    if (devices_.seen(k).has_hand) hand.served.map.receive(devices_.seen(k).hand);
  }
}

void HapticLoop::read(double time, int periods) noexcept {
  for (int k = 0; k < devices_.count(); ++k) {
    Hand& hand = hands_[k];
    for (int i = 0; i < periods && hand.glide.moving(); ++i) hand.aim = hand.glide.advance();
    devices_.aim(k, hand.aim);
  }
  devices_.read(time);
  for (int k = 0; k < devices_.count(); ++k) {
    Hand& hand = hands_[k];
    const PointerPose before = hand.served.map.world();
    if (devices_.seen(k).has_hand) hand.served.map.receive(devices_.seen(k).hand);
    hand.rate.follow(before, hand.served.map.world(), periods * h_);
  }
}

CouplingTarget HapticLoop::target_of(int port, Hand& hand) noexcept {
  const PointerPose& pointer = hand.served.map.world();
  CouplingTarget target{.position = pointer.position + hand.served.position_offset,
                        .rotation = pointer.rotation * hand.served.rotation_offset,
                        .velocity = hand.rate.linear,
                        .angular_velocity = hand.rate.angular};
  if (!is_fingertip_[port]) return target;
  const TipMotion tip{
      .rotation = local_.rotation(port), .angular_velocity = local_.velocity(port).angular, .normal = hand.normal};
  const SoftTip::Target soft = hand.soft.follow(target.rotation, target.angular_velocity, tip,
                                                gains_[port].angular_stiffness, gains_[port].angular_damping);
  target.rotation = soft.rotation;
  target.angular_velocity = soft.angular_velocity;
  return target;
}

void HapticLoop::render() noexcept {
  for (int i = 0; i < pointers_; ++i) targets_[i] = target_of(i, hands_[pointer_[i]]);
  local_.tick({targets_.data(), static_cast<std::size_t>(pointers_)},
              {felt_.data(), static_cast<std::size_t>(pointers_)});
  ++summed_;
  for (int i = 0; i < pointers_; ++i) {
    if (is_fingertip_[i]) {
      Hand& hand = hands_[pointer_[i]];
      felt_[i].torque = hand.soft.of_hand(felt_[i].torque);
      hand.normal = local_.touched(i).normal;
    }
    PortWrench& sum = sums_[pointer_[i]];
    sum.force += felt_[i].force;
    sum.torque += felt_[i].torque;
  }
}

bool HapticLoop::is_overdue(double time) const noexcept {
  return !answered_ && time - asked_ > ticks_ * h_ + kPatience;
}

void HapticLoop::exert(double time) noexcept {
  std::array<bool, kMostPointers> has_port{};
  for (int i = 0; i < pointers_; ++i) {
    const int k = pointer_[i];
    const ServedHand& hand = hands_[k].served;
    has_port[k] = hand.has_tool;
    if (!hand.has_tool) continue;
    const dynamics::BodyForce on_hand = hand.map.to_hand({.force = felt_[i].force, .torque = felt_[i].torque});
    devices_.render(k, {.force = on_hand.force, .torque = on_hand.torque}, true);
  }
  for (int k = 0; k < devices_.count(); ++k) {
    if (!has_port[k]) devices_.render(k, {}, false);
  }
  if (is_overdue(time)) devices_.fail(device::Fault::kStalled);
  devices_.exert(time, h_);
}

void HapticLoop::report() noexcept {
  const std::span<const PortLoad> loads = local_.end_interval();
  report_.load_count = static_cast<int>(loads.size());
  std::copy(loads.begin(), loads.end(), report_.loads.begin());
  report_.tools.fill({});
  const double share = summed_ > 0 ? 1.0 / summed_ : 0.0;
  for (int i = 0; i < pointers_; ++i) {
    const PortWrench& sum = sums_[pointer_[i]];
    report_.tools[pointer_[i]] = {.has_port = true,
                                  .force = {.force = -share * sum.force, .torque = -share * sum.torque},
                                  .touched = local_.touched(i),
                                  .position = local_.position(i),
                                  .rotation = local_.rotation(i),
                                  .velocity = local_.velocity(i)};
  }
  for (int k = 0; k < devices_.count(); ++k) report_.devices[k] = devices_.seen(k);
  report_.ledger = local_.ledger();
  reports_.write(report_);
  sums_.fill({});
  summed_ = 0;
}

void HapticLoop::end_interval(double time, int periods) noexcept {
  elapsed_ += periods;
  if (elapsed_ < ticks_ || !answered_) return;
  const int most = std::max(ticks_, static_cast<int>(kMostBehind / h_));
  elapsed_ = std::min(elapsed_ - ticks_, most);
  report_.next = time + std::max(ticks_ - elapsed_, 1) * h_;
  report();
  answered_ = false;
  asked_ = time;
}

void HapticLoop::tick(double time, int periods) noexcept {
  const std::int64_t begin = now_ns();
  if (!started_) asked_ = time;
  started_ = true;
  receive();
  read(time, periods);
  if (sound_) {
    render();
    exert(time);
  } else {
    devices_.let_go(time);
  }
  report_.ticks.add(1e-9 * static_cast<double>(now_ns() - begin), periods);
  end_interval(time, periods);
}

}  // namespace layfigure::haptics
