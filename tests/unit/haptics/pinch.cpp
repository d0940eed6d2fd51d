#include "pinch.h"

#include <stdexcept>

#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

constexpr double kClearance = 1e-3;  // [m] between limb and fingertip at the start

double side_of(int id) { return id == 0 ? 1.0 : -1.0; }

}  // namespace

PointerPose at(const Eigen::Vector3d& position) { return {.position = position}; }

void run(Hands& hands, int steps) {
  for (int k = 0; k < steps; ++k) {
    if (hands.step().status != dynamics::StepStatus::kOk) throw std::runtime_error("a step failed");
  }
}

Pinch::Pinch(Hands& hands, const Eigen::Vector3d& middle, const FingertipDefinition& fingertip)
    : hands_(hands), middle_(middle), contact_distance_(testing::kLimbRadius + fingertip.radius) {
  for (const int id : {0, 1}) {
    aim(id, -kClearance);
    hands_.touch({.pointer = id, .fingertip = fingertip, .stiffness = kPinchStiffness});
  }
}

void Pinch::aim(int id, double squeeze, const Eigen::Vector3d& shift) {
  const Eigen::Vector3d away = side_of(id) * (contact_distance_ - squeeze) * Eigen::Vector3d::UnitY();
  hands_.receive(id, at(middle_ + away + shift));
}

void Pinch::glide_to(double squeeze, int steps, const Eigen::Vector3d& shift) {
  for (const int id : {0, 1}) aim(id, squeeze, shift);
  hands_.glide(steps);
}

double Pinch::pressure(int id) const { return -side_of(id) * hands_.pointers().at(id).grip()->force.force.y(); }

Eigen::Vector3d fingertip_in_body(const Hands& hands, int pointer, int body) {
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(hands.model(), hands.state(), poses);
  const int tip = hands.pointers().at(pointer).grip()->coupling.body;
  return poses[body].rotation.conjugate() * (poses[tip].origin - poses[body].origin);
}

}  // namespace layfigure::haptics
