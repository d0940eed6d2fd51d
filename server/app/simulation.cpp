#include "layfigure/app/simulation.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "layfigure/messaging/protocol.h"

namespace layfigure::app {
namespace {

constexpr double kGripFrequency = 2.0 * std::numbers::pi * 3.0;  // [rad/s] of the whole doll on a grip
constexpr double kLongestGlide = 0.05;                           // [s]

double clock_us(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

double total_mass(const dynamics::Model& model) {
  double mass = 0.0;
  for (int i = 0; i < model.size(); ++i) mass += model.body(i).mass;
  return mass;
}

}  // namespace

Simulation::Simulation(doll::Doll doll, const SimulationSettings& settings)
    : doll_(std::move(doll)),
      settings_(settings),
      scene_({.model = doll_.definition, .shapes = doll_.shapes, .excluded = doll_.never_touch}),
      state_(dynamics::initial_state(scene_.model())),
      total_mass_(total_mass(scene_.model())),
      statistics_(settings.physics_hz) {
  pin_roots();
  couplings_.reserve(pins_.size() + messaging::kMaxPointers);
}

void Simulation::pin_roots() {
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(scene_.model(), state_, poses);
  const doll::RootPin& gains = doll_.root_pin;
  for (int i = 0; i < scene_.model().size(); ++i) {
    if (scene_.model().body(i).parent >= 0) continue;
    dynamics::Coupling pin;
    pin.body = i;
    pin.point = scene_.model().body(i).com;
    pin.stiffness = gains.stiffness;
    pin.damping = gains.damping;
    pin.angular_stiffness = gains.angular_stiffness;
    pin.angular_damping = gains.angular_damping;
    pin.target_position = poses[i].com;
    pin.target_rotation = poses[i].rotation;
    pins_.push_back(pin);
  }
}

std::int64_t Simulation::time_us() const {
  return std::llround(static_cast<double>(steps_) * 1e6 / settings_.physics_hz);
}

void Simulation::point(int id, const PointerPose& pose, const std::string& client_id, std::int64_t sequence) {
  Pointer& pointer = pointers_[id];
  if (pointer.client_id() == client_id && sequence <= pointer.sequence()) return;
  pointer.receive(pose, client_id, sequence, steps_, std::max(1.0, kLongestGlide * settings_.physics_hz));
  resting_ = false;
  if (settings_.clock == ClockKind::kRealtime) pointer.glide(std::llround(pointer.message_interval()));
}

void Simulation::begin_motion(std::int64_t steps) {
  for (auto& [id, pointer] : pointers_) pointer.glide(steps);
}

Eigen::Vector3d Simulation::grab(const GrabRequest& request) {
  const std::vector<character::Bone>& bones = doll_.rig.bones;
  if (doll_.carriers.at(request.bone).body < 0) {
    throw std::invalid_argument("bone '" + bones[request.bone].name + "' is carried by no body");
  }
  const auto existing = pointers_.find(request.pointer);
  if (existing != pointers_.end() && existing->second.grip()) {
    throw std::invalid_argument("pointer " + std::to_string(request.pointer) + " holds '" +
                                bones[existing->second.grip()->bone].name + "' already; release it first");
  }
  Grip grip;
  grip.bone = request.bone;
  grip.coupling = make_coupling(request);
  const PointerPose held = held_pose(grip);
  pointers_[request.pointer].attach(grip, held);
  resting_ = false;
  return held.position;
}

dynamics::Coupling Simulation::make_coupling(const GrabRequest& request) const {
  const doll::Carrier& carrier = doll_.carriers[request.bone];
  const dynamics::BodyDefinition& body = scene_.model().body(carrier.body);
  const bool has_own_body = doll_.body_of_bone[request.bone] >= 0;
  const Eigen::Vector3d default_point = has_own_body ? body.com : Eigen::Vector3d(carrier.pose.translation());
  dynamics::Coupling coupling;
  coupling.body = carrier.body;
  coupling.point = request.point ? Eigen::Vector3d(carrier.pose * *request.point) : default_point;
  coupling.stiffness = request.stiffness.value_or(total_mass_ * kGripFrequency * kGripFrequency);
  coupling.damping = request.damping.value_or(2.0 * std::sqrt(coupling.stiffness * total_mass_));
  if (request.holds_rotation) {
    const double gyration_squared = body.inertia.trace() / (2.0 * body.mass);
    coupling.angular_stiffness = gyration_squared * coupling.stiffness;
    coupling.angular_damping = gyration_squared * coupling.damping;
  }
  return coupling;
}

void Simulation::release(int pointer) {
  const auto found = pointers_.find(pointer);
  if (found == pointers_.end() || !found->second.grip()) {
    throw std::invalid_argument("pointer " + std::to_string(pointer) + " holds nothing");
  }
  found->second.detach();
  resting_ = false;
}

void Simulation::reset() {
  state_ = dynamics::initial_state(scene_.model());
  scene_.forget();
  state_.time = static_cast<double>(steps_) / settings_.physics_hz;
  for (auto& [id, pointer] : pointers_) {
    if (pointer.grip()) pointer.detach();
  }
  yielding_joints_ = 0;
  resting_ = false;
  failure_.clear();
}

bool Simulation::advance() {
  if (!failure_.empty()) return false;
  collect_couplings();
  const double cpu_begin = clock_us(CLOCK_THREAD_CPUTIME_ID);
  const double wall_begin = clock_us(CLOCK_MONOTONIC);
  const dynamics::StepReport report =
      scene_
          .step(state_, {.couplings = couplings_},
                {.step = 1.0 / settings_.physics_hz, .order = 1, .sleep_angle = dynamics::kSleepAngle})
          .step;
  statistics_.record({clock_us(CLOCK_THREAD_CPUTIME_ID) - cpu_begin, clock_us(CLOCK_MONOTONIC) - wall_begin});
  if (report.status != dynamics::StepStatus::kOk) {
    failure_ = "step " + std::to_string(steps_ + 1) + " would not be finite; reset to go on";
    return false;
  }
  ++steps_;
  state_.time = static_cast<double>(steps_) / settings_.physics_hz;
  yielding_joints_ = report.yielding;
  resting_ = report.resting;
  if (!resting_) distribute_forces();
  return true;
}

void Simulation::rest(std::int64_t steps) {
  steps_ += steps;
  state_.time = static_cast<double>(steps_) / settings_.physics_hz;
}

void Simulation::collect_couplings() {
  couplings_.assign(pins_.begin(), pins_.end());
  for (auto& [id, pointer] : pointers_) {
    if (pointer.grip()) couplings_.push_back(pointer.aim(1.0 / settings_.physics_hz));
  }
}

void Simulation::distribute_forces() {
  int index = static_cast<int>(pins_.size());
  for (auto& [id, pointer] : pointers_) {
    if (pointer.grip()) pointer.finish_step(scene_.coupling_force(index++));
  }
}

PointerPose Simulation::held_pose(const Grip& grip) const {
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(scene_.model(), state_, poses);
  const dynamics::BodyPose& body = poses[grip.coupling.body];
  return {body.origin + body.rotation * grip.coupling.point, body.rotation};
}

}  // namespace layfigure::app
