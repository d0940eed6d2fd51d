#include "layfigure/haptics/pins.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace layfigure::haptics {
namespace {

constexpr double kPinFrequency = 2.0 * std::numbers::pi * 100.0;  // [rad/s] of the whole doll on one pin

dynamics::Coupling pin_coupling(double mass, const dynamics::BodyDefinition& body, bool holds_rotation) {
  dynamics::Coupling coupling;
  coupling.stiffness = mass * kPinFrequency * kPinFrequency;
  coupling.damping = 2.0 * mass * kPinFrequency;
  if (holds_rotation) {
    const double gyration_squared = body.inertia.trace() / (2.0 * body.mass);
    coupling.angular_stiffness = gyration_squared * coupling.stiffness;
    coupling.angular_damping = gyration_squared * coupling.damping;
  }
  return coupling;
}

}  // namespace

Eigen::Vector3d held_point(const doll::Doll& doll, int bone, const std::optional<Eigen::Vector3d>& point) {
  const doll::Carrier& carrier = doll.carriers.at(bone);
  if (carrier.body < 0) throw std::invalid_argument("bone '" + doll.rig.bones[bone].name + "' is carried by no body");
  if (point) return carrier.pose * *point;
  const bool has_own_body = doll.body_of_bone[bone] >= 0;
  return has_own_body ? doll.definition.bodies[carrier.body].com : Eigen::Vector3d(carrier.pose.translation());
}

int Pins::add(const doll::Doll& doll, double mass, const dynamics::State& state, const dynamics::Model& model,
              const PinRequest& request) {
  const Eigen::Vector3d point = held_point(doll, request.bone, request.point);
  const int body = doll.carriers[request.bone].body;
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(model, state, poses);
  Pin pin{.id = next_id_, .bone = request.bone, .rigid = request.rigid};
  pin.position = poses[body].origin + poses[body].rotation * point;
  if (request.rigid) {
    pin.tie = {.body_a = body, .body_b = dynamics::kWorld, .point_a = point, .point_b = pin.position};
    pin.tie.holds_rotation = request.holds_rotation;
    pin.tie.rotation = poses[body].rotation;
  } else {
    pin.coupling = pin_coupling(mass, model.body(body), request.holds_rotation);
    pin.coupling.body = body;
    pin.coupling.point = point;
    pin.coupling.target_position = pin.position;
    pin.coupling.target_rotation = poses[body].rotation;
  }
  pins_.push_back(pin);
  return next_id_++;
}

void Pins::restore(std::span<const Pin> pins) {
  pins_.assign(pins.begin(), pins.end());
  for (const Pin& pin : pins) next_id_ = std::max(next_id_, pin.id + 1);
}

void Pins::settle(const dynamics::Model& model, const dynamics::State& state) {
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(model, state, poses);
  for (Pin& pin : pins_) {
    const dynamics::BodyPose& body = poses[pin.rigid ? pin.tie.body_a : pin.coupling.body];
    pin.position = body.origin + body.rotation * (pin.rigid ? pin.tie.point_a : pin.coupling.point);
    pin.tie.point_b = pin.coupling.target_position = pin.position;
    pin.tie.rotation = pin.coupling.target_rotation = body.rotation;
  }
}

bool Pins::remove(int id) {
  return std::erase_if(pins_, [id](const Pin& pin) { return pin.id == id; }) > 0;
}

}  // namespace layfigure::haptics
