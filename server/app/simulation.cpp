#include "layfigure/app/simulation.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace layfigure::app {
namespace {

constexpr double kLongestGlide = 0.05;  // [s]

double clock_us(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Simulation::Simulation(doll::Doll doll, const SimulationSettings& settings, haptics::DeviceHands devices)
    : settings_(settings),
      hands_(std::move(doll), 1.0 / settings.physics_hz),
      devices_(std::move(devices)),
      statistics_(settings.physics_hz) {
  devices_.place_around(hands_);
  if (!devices_.empty() && settings.haptic_ticks > 1) {
    devices_.serve(settings.haptic_ticks, 1.0 / (settings.haptic_ticks * settings.physics_hz), hands_);
  }
}

void Simulation::start_haptic_thread() {
  if (settings_.clock == ClockKind::kRealtime && devices_.ticks() > 1) devices_.start_thread(hands_);
}

double Simulation::device_time() const {
  return settings_.clock == ClockKind::kLockstep ? time() : 1e-6 * clock_us(CLOCK_MONOTONIC);
}

std::int64_t Simulation::time_us() const {
  return std::llround(static_cast<double>(steps_) * 1e6 / settings_.physics_hz);
}

void Simulation::point(int id, const PointerPose& pose, const std::string& client_id, std::int64_t sequence) {
  PointerInput& input = inputs_[id];
  if (input.is_old(client_id, sequence)) return;
  input.receive(client_id, sequence, steps_, std::max(1.0, kLongestGlide * settings_.physics_hz));
  resting_ = false;
  const bool of_device = devices_.drives(id);
  if (of_device) {
    devices_.guide(id, pose, hands_);
  } else {
    hands_.receive(id, pose);
  }
  if (settings_.clock == ClockKind::kLockstep) return;
  const std::int64_t steps = std::llround(input.message_interval());
  if (of_device) {
    devices_.glide(id, steps);
  } else {
    hands_.glide(id, steps);
  }
}

void Simulation::begin_motion(std::int64_t steps) {
  hands_.glide(steps);
  devices_.glide(steps);
}

Eigen::Vector3d Simulation::grab(const GrabRequest& request) {
  const Eigen::Vector3d held = hands_.grab(request);
  note_tools();
  resting_ = false;
  return held;
}

void Simulation::touch(const TouchRequest& request) {
  hands_.touch(request);
  note_tools();
  resting_ = false;
}

void Simulation::release(int pointer) {
  hands_.release(pointer);
  note_tools();
  resting_ = false;
}

bool Simulation::advance() {
  if (!failure_.empty()) {
    devices_.let_go(device_time());
    return false;
  }
  devices_.follow_buttons(hands_);
  note_tools();
  const double cpu_begin = clock_us(CLOCK_THREAD_CPUTIME_ID);
  const double wall_begin = clock_us(CLOCK_MONOTONIC);
  devices_.begin_step(device_time(), hands_);
  const dynamics::StepReport report = hands_.step();
  const bool sound = report.status == dynamics::StepStatus::kOk;
  if (sound) {
    devices_.end_step(device_time(), hands_);
  } else {
    devices_.let_go(device_time());
  }
  statistics_.record({clock_us(CLOCK_THREAD_CPUTIME_ID) - cpu_begin, clock_us(CLOCK_MONOTONIC) - wall_begin});
  if (device_log_) device_log_(devices_.input());
  if (!sound) {
    failure_ = "step " + std::to_string(steps_ + 1) + " would not be finite; reset to go on";
    return false;
  }
  ++steps_;
  hands_.set_time(time());
  yielding_joints_ = report.yielding;
  resting_ = report.resting && devices_.empty();
  return true;
}

void Simulation::rest(std::int64_t steps) {
  steps_ += steps;
  hands_.set_time(time());
}

}  // namespace layfigure::app
