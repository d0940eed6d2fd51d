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

Simulation::Simulation(doll::Doll doll, const SimulationSettings& settings)
    : settings_(settings), hands_(std::move(doll), 1.0 / settings.physics_hz), statistics_(settings.physics_hz) {}

std::int64_t Simulation::time_us() const {
  return std::llround(static_cast<double>(steps_) * 1e6 / settings_.physics_hz);
}

void Simulation::point(int id, const PointerPose& pose, const std::string& client_id, std::int64_t sequence) {
  PointerInput& input = inputs_[id];
  if (input.is_old(client_id, sequence)) return;
  input.receive(client_id, sequence, steps_, std::max(1.0, kLongestGlide * settings_.physics_hz));
  hands_.receive(id, pose);
  resting_ = false;
  if (settings_.clock == ClockKind::kRealtime) hands_.glide(id, std::llround(input.message_interval()));
}

void Simulation::begin_motion(std::int64_t steps) { hands_.glide(steps); }

Eigen::Vector3d Simulation::grab(const GrabRequest& request) {
  const Eigen::Vector3d held = hands_.grab(request);
  resting_ = false;
  return held;
}

void Simulation::touch(const TouchRequest& request) {
  hands_.touch(request);
  resting_ = false;
}

void Simulation::release(int pointer) {
  hands_.release(pointer);
  resting_ = false;
}

const haptics::Pin& Simulation::pin(const PinRequest& request) {
  const haptics::Pin& pin = hands_.pin(request);
  resting_ = false;
  return pin;
}

void Simulation::unpin(int id) {
  hands_.unpin(id);
  resting_ = false;
}

void Simulation::unpin_all() {
  hands_.unpin_all();
  resting_ = false;
}

void Simulation::set(const HandSettings& settings) {
  if (settings.base) hands_.require_no_tool(settings.pointer);
  if (settings.magnet) hands_.require_fingertip(settings.pointer);
  if (settings.bone) hands_.require_joint(*settings.bone);
  if (settings.base) hands_.set_base(settings.pointer, *settings.base);
  if (settings.scale) hands_.set_scale(settings.pointer, *settings.scale);
  if (settings.clutch) hands_.set_clutch(settings.pointer, *settings.clutch);
  if (settings.magnet) hands_.set_magnet(settings.pointer, *settings.magnet);
  if (settings.softness && settings.bone) {
    hands_.set_softness(*settings.softness, *settings.bone);
  } else if (settings.softness) {
    hands_.set_softness(*settings.softness);
  }
  resting_ = false;
}

void Simulation::reset() {
  hands_.reset();
  hands_.set_time(time());
  yielding_joints_ = 0;
  resting_ = false;
  failure_.clear();
}

bool Simulation::advance() {
  if (!failure_.empty()) return false;
  const double cpu_begin = clock_us(CLOCK_THREAD_CPUTIME_ID);
  const double wall_begin = clock_us(CLOCK_MONOTONIC);
  const dynamics::StepReport report = hands_.step();
  statistics_.record({clock_us(CLOCK_THREAD_CPUTIME_ID) - cpu_begin, clock_us(CLOCK_MONOTONIC) - wall_begin});
  if (report.status != dynamics::StepStatus::kOk) {
    failure_ = "step " + std::to_string(steps_ + 1) + " would not be finite; reset to go on";
    return false;
  }
  ++steps_;
  hands_.set_time(time());
  yielding_joints_ = report.yielding;
  resting_ = report.resting;
  return true;
}

void Simulation::rest(std::int64_t steps) {
  steps_ += steps;
  hands_.set_time(time());
}

}  // namespace layfigure::app
