#include "pinch.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "pinched_doll.h"

namespace layfigure::haptics {
namespace {

constexpr double kGravity = 9.81;    // [m/s^2]
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

double pinch_drift(double duration, double off_center, double tremor) {
  Hands hands(testing::pinched_limb(off_center), kStep);
  Pinch pinch(hands, {0, 0, 1});
  constexpr double kSqueeze = 0.01;
  pinch.glide_to(kSqueeze, 20);
  run(hands, 1000);
  const Eigen::Vector3d before[] = {fingertip_in_body(hands, 0, 0), fingertip_in_body(hands, 1, 0)};
  constexpr int kInterval = 10;  // [steps] between the hands' poses
  for (int k = 0; kInterval * kStep * k < duration; ++k) {
    const double t = kInterval * kStep * k;
    const Eigen::Vector3d shift = tremor * Eigen::Vector3d(std::sin(55.0 * t), 0, std::cos(63.0 * t));
    pinch.glide_to(kSqueeze + tremor * std::sin(70.0 * t), kInterval, shift);
    run(hands, kInterval);
  }
  pinch.glide_to(kSqueeze, kInterval);
  run(hands, 1000);
  double drift = 0.0;
  for (const int id : {0, 1}) drift = std::max(drift, (fingertip_in_body(hands, id, 0) - before[id]).norm());
  return drift;
}

TiltDrift drift_by_tilting(Tilting how, int circles, double tilt, double off_center) {
  const Eigen::Vector3d middle(0, 0, 1);
  Hands hands(testing::pinched_limb(off_center), kStep);
  Pinch pinch(hands, middle);
  constexpr double kSqueeze = 0.01;
  constexpr int kInterval = 10;  // [steps] between the hands' poses
  constexpr int kTilting = 50;   // intervals
  constexpr int kCircle = 100;
  pinch.glide_to(kSqueeze, 20);
  run(hands, 1000);
  const Eigen::Vector3d before[] = {fingertip_in_body(hands, 0, 0), fingertip_in_body(hands, 1, 0)};
  const Eigen::Quaterniond rotation_before = hands.state().bodies[0].rotation;
  const double away = testing::kLimbRadius + kFingertipRadius - kSqueeze;
  const auto tilt_to = [&](double angle, double phase) {
    const Eigen::Quaterniond R(Eigen::AngleAxisd(angle, Eigen::Vector3d(std::cos(phase), 0, std::sin(phase))));
    for (const int id : {0, 1}) {
      const Eigen::Vector3d to_tip = side_of(id) * away * Eigen::Vector3d::UnitY();
      const Eigen::Vector3d turned = how == Tilting::kInPlace ? to_tip : R * to_tip;
      hands.receive(id, {.position = middle + turned, .rotation = R});
    }
    hands.glide(kInterval);
    run(hands, kInterval);
  };
  for (int k = 1; k <= kTilting; ++k) tilt_to(tilt * k / kTilting, 0.0);
  for (int k = 1; k <= circles * kCircle; ++k) tilt_to(tilt, 2.0 * std::numbers::pi * k / kCircle);
  for (int k = kTilting - 1; k >= 0; --k) tilt_to(tilt * k / kTilting, 0.0);
  run(hands, 1000);
  TiltDrift drift{.way = 0.0, .turn = hands.state().bodies[0].rotation.angularDistance(rotation_before)};
  for (const int id : {0, 1}) drift.way = std::max(drift.way, (fingertip_in_body(hands, id, 0) - before[id]).norm());
  return drift;
}

double slip_pressure(double friction) {
  // With a shape of friction 0.5; each finger carries half.
  return 0.5 * testing::kLimbMass * kGravity / std::sqrt(0.5 * friction);
}

double pressure_at_slip(double friction) {
  Hands hands(testing::pinched_limb(), kStep);
  const FingertipDefinition fingertip{.friction = friction};
  Pinch pinch(hands, {0, 0, 1}, fingertip);
  double squeeze = 1.5 * slip_pressure(friction) / kPinchStiffness;
  pinch.glide_to(squeeze, 20);
  run(hands, 1000);
  const double before = fingertip_in_body(hands, 0, 0).z();
  constexpr double kOpening = 1e-7;  // [m] in a step: 0.1 N/s
  constexpr double kSlid = 5e-4;     // [m]; before it slips the pad rolls by a tenth of this
  constexpr int kInterval = 10;
  while (squeeze > 0.0 && fingertip_in_body(hands, 0, 0).z() - before < kSlid) {
    squeeze -= kInterval * kOpening;
    pinch.glide_to(squeeze, kInterval);
    run(hands, kInterval);
  }
  return pinch.pressure(0);
}

Eigen::Vector3d fingertip_in_body(const Hands& hands, int pointer, int body) {
  std::vector<dynamics::BodyPose> poses;
  dynamics::world_poses(hands.model(), hands.state(), poses);
  const int tip = hands.pointers().at(pointer).grip()->coupling.body;
  return poses[body].rotation.conjugate() * (poses[tip].origin - poses[body].origin);
}

}  // namespace layfigure::haptics
