#include "lcm_driver.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <layfigure/spidar_command_t.hpp>
#include <layfigure/spidar_state_t.hpp>
#include <thread>

#include "layfigure/device/latest_value.h"
#include "layfigure/device/simulated_spidar.h"

namespace layfigure::device {
namespace {

using Clock = std::chrono::steady_clock;
using messaging::Channel;

constexpr std::chrono::seconds kLogInterval{1};
// Last words: more than one, as a datagram may be lost.
constexpr int kFarewells = 3;
// What the numbers of a spidar_command_t are.
constexpr std::int32_t kTensions = 0;
constexpr std::int32_t kWrench = 1;

/// A spidar_state_t as plain data.
struct State {
  std::int64_t sequence{0};
  std::int32_t kind{messaging::kSpidarRejected};
  double lengths[spidar::kStrings]{};
  double position[3]{};
  double rotation[4]{};
  double grip{0.0};
  std::uint32_t buttons{0};
};

/// A spidar_command_t as plain data.
struct Command {
  std::int64_t state_sequence{0};
  bool active{false};
  std::int32_t kind{kTensions};
  double tensions[spidar::kStrings]{};
  double force[3]{};
  double torque[3]{};
};

template <std::size_t N>
void copy(const double (&from)[N], double (&to)[N]) {
  std::copy_n(from, N, to);
}

std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class LcmDriver : public Driver {
 public:
  explicit LcmDriver(const LcmSettings& settings)
      : id_(settings.device_id),
        info_(settings.info),
        kinematics_(settings.geometry ? std::make_unique<SpidarKinematics>(*settings.geometry) : nullptr),
        bus_(settings.bus, {{Channel::kSpidarState, [this](messaging::ByteView bytes) { receive(bytes); }}}) {
    sender_ = std::thread([this] { send_loop(); });
  }
  ~LcmDriver() override { close(); }
  LcmDriver(const LcmDriver&) = delete;
  LcmDriver& operator=(const LcmDriver&) = delete;

  [[nodiscard]] const Info& info() const noexcept override { return info_; }

  [[nodiscard]] Reading read(double /*time*/) noexcept override {
    if (!states_.read(state_)) return {.status = Reading::Status::kNothingNew};
    Reading reading{.status = Reading::Status::kInvalid};
    if (state_.kind == messaging::kSpidarLengths && kinematics_) {
      reading = kinematics_->read(Eigen::Map<const spidar::Lengths>(state_.lengths) + kinematics_->geometry().offsets);
    } else if (state_.kind == messaging::kSpidarPose) {
      const auto& [w, x, y, z] = state_.rotation;
      reading.status = Reading::Status::kOk;
      reading.position = Eigen::Vector3d(state_.position);
      reading.rotation = Eigen::Quaterniond(w, x, y, z).normalized();
    }
    reading.grip = state_.grip;
    reading.buttons = state_.buttons;
    return reading;
  }

  void write(const Wrench& wrench) noexcept override {
    exerted_ = possible(wrench, info_);
    Command command{.state_sequence = state_.sequence, .active = true};
    if (kinematics_) {
      const spidar::Tensions& tensions = kinematics_->tensions(exerted_);
      std::copy_n(tensions.data(), spidar::kStrings, command.tensions);
    } else {
      command.kind = kWrench;
      std::copy_n(exerted_.force.data(), 3, command.force);
      std::copy_n(exerted_.torque.data(), 3, command.torque);
    }
    commands_.write(command);
    wake();
  }

  [[nodiscard]] Wrench exerted() const noexcept override { return exerted_; }

  void close() noexcept override {
    if (!sender_.joinable()) return;
    exerted_ = {};
    closing_ = true;
    wake();
    sender_.join();
  }

 private:
  /// On the bus's thread.
  void receive(messaging::ByteView bytes) {
    const messaging::Decoded<spidar_state_t> decoded = messaging::decode_spidar_state(bytes);
    if (!decoded.message) return complain("refused a state: " + decoded.problem);
    const spidar_state_t& message = *decoded.message;
    if (message.device_id != id_) return;
    // Older ones come late; a device process that was started anew counts from 1 again.
    if (message.sequence <= newest_ && message.sequence != 1) return;
    newest_ = message.sequence;
    if (message.kind == messaging::kSpidarLengths && !kinematics_) {
      complain("it tells lengths, but no geometry is known: name one in the --device-config file");
    }
    State state{.sequence = message.sequence, .kind = message.kind};
    copy(message.lengths, state.lengths);
    copy(message.position, state.position);
    copy(message.rotation, state.rotation);
    state.grip = message.grip;
    state.buttons = static_cast<std::uint32_t>(message.buttons);
    states_.write(state);
  }

  void complain(const std::string& what) {
    const Clock::time_point now = Clock::now();
    if (now < next_log_) return;
    next_log_ = now + kLogInterval;
    spdlog::warn("device '{}': {}", id_, what);
  }

  void wake() noexcept {
    woken_.fetch_add(1, std::memory_order_release);
    woken_.notify_one();
  }

  void send_loop() {
    std::uint32_t seen = 0;
    while (!closing_) {
      woken_.wait(seen, std::memory_order_acquire);
      seen = woken_.load(std::memory_order_acquire);
      Command command;
      if (commands_.read(command)) send(command);
    }
    for (int k = 0; k < kFarewells; ++k) send({.kind = kinematics_ ? kTensions : kWrench});
  }

  void send(const Command& command) {
    spidar_command_t message{};
    message.protocol_version = messaging::kProtocolVersion;
    message.time_us = now_us();
    message.device_id = id_;
    message.sequence = ++sequence_;
    message.state_sequence = command.state_sequence;
    message.active = command.active;
    message.kind = command.kind;
    copy(command.tensions, message.tensions);
    copy(command.force, message.force);
    copy(command.torque, message.torque);
    bus_.publish(Channel::kSpidarCommand, message);
  }

  const std::string id_;
  const Info info_;
  const std::unique_ptr<SpidarKinematics> kinematics_;  // the haptic thread's, but for whether it is there
  // The haptic thread's.
  State state_{};
  Wrench exerted_;
  // The bus's thread's.
  std::int64_t newest_{0};
  Clock::time_point next_log_{};
  // The sending thread's.
  std::int64_t sequence_{0};

  LatestValue<State> states_;
  LatestValue<Command> commands_;
  std::atomic<std::uint32_t> woken_{0};
  std::atomic<bool> closing_{false};
  messaging::Bus bus_;
  std::thread sender_;
};

}  // namespace

std::unique_ptr<Driver> open_lcm(const LcmSettings& settings) { return std::make_unique<LcmDriver>(settings); }

}  // namespace layfigure::device
