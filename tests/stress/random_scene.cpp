#include "random_scene.h"

#include <array>
#include <cmath>
#include <random>

#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  bool one_in(int n) { return random_() % static_cast<std::uint64_t>(n) == 0; }
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1.0p-53;
  }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  Eigen::Vector3d vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  Eigen::Quaterniond rotation(double size) { return math::exp_rotation(vector(size)); }

 private:
  std::mt19937_64 random_;
};

Eigen::Matrix3d random_inertia(Dice& dice, double mass) {
  if (dice.one_in(10)) return Eigen::Matrix3d::Zero();  // a point
  const double size = dice.log_uniform(1e-3, 1.0);
  // A box; one in ten has no thickness at all.
  const Eigen::Vector3d side(size, size * dice.log_uniform(1e-3, 1.0), dice.one_in(10) ? 0.0 : size);
  const Eigen::Vector3d squares = mass / 12.0 * side.cwiseAbs2();
  const Eigen::Matrix3d R = math::exp_rotation(dice.vector(2.0)).toRotationMatrix();
  const Eigen::Vector3d moments(squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y());
  const Eigen::Matrix3d inertia = R * moments.asDiagonal() * R.transpose();
  return 0.5 * (inertia + inertia.transpose());
}

JointLaw random_law(Dice& dice) {
  JointLaw law;
  law.stiffness = dice.one_in(6) ? 0.0 : dice.log_uniform(1e-4, 1e9);
  law.damping = dice.one_in(4) ? 0.0 : dice.log_uniform(1e-6, 1e3);
  if (dice.one_in(2)) law.yield_torque = dice.one_in(5) ? 0.0 : dice.log_uniform(1e-4, 1e3);
  law.flow_damping = dice.one_in(4) ? 0.0 : dice.log_uniform(1e-4, 1e3);
  law.hardening = dice.one_in(3) ? dice.log_uniform(1e-3, 1e2) : 0.0;
  if (dice.one_in(3)) {
    law.shape.axes = math::exp_rotation(dice.vector(2.0));
    law.shape.stiffness = {dice.log_uniform(0.1, 10.0), 1.0, dice.log_uniform(0.1, 10.0)};
    law.shape.yield = {1.0, dice.log_uniform(0.1, 10.0), dice.one_in(4) ? INFINITY : 1.0};
    law.shape.locked = {dice.one_in(4), dice.one_in(4), dice.one_in(4)};
  }
  return law;
}

BodyDefinition random_body(Dice& dice, int index) {
  BodyDefinition body;
  body.name = "body" + std::to_string(index);
  body.parent = index == 0 ? -1 : dice.one_in(3) ? dice.below(index) : index - 1;
  body.anchor = dice.one_in(8) ? Eigen::Vector3d::Zero() : dice.vector(0.3);
  body.rotation = math::exp_rotation(dice.vector(1.5));
  if (dice.one_in(2)) body.rest_rotation = body.rotation;
  body.mass = dice.log_uniform(1e-3, 1e3);
  body.com = dice.one_in(8) ? Eigen::Vector3d::Zero() : dice.vector(0.2);
  body.inertia = random_inertia(dice, body.mass);
  body.joint = random_law(dice);
  return body;
}

Coupling random_coupling(Dice& dice, int bodies) {
  Coupling coupling;
  coupling.body = dice.below(bodies);
  coupling.point = dice.vector(0.2);
  coupling.stiffness = dice.log_uniform(1.0, 1e7);
  coupling.damping = dice.one_in(3) ? 0.0 : dice.log_uniform(0.1, 1e4);
  if (dice.one_in(2)) {
    coupling.angular_stiffness = dice.log_uniform(1e-2, 1e5);
    coupling.angular_damping = dice.log_uniform(1e-3, 1e2);
  }
  coupling.target_position = dice.vector(2.0);
  return coupling;
}

JointLimits random_limits(Dice& dice, const Eigen::Quaterniond& rotation) {
  JointLimits limits;
  limits.axes = dice.rotation(2.0);
  // One in four starts beyond its limits.
  limits.reference = dice.one_in(4) ? dice.rotation(2.0) : rotation;
  if (!dice.one_in(3)) {
    limits.twist_lower = -dice.log_uniform(1e-3, 2.0);
    limits.twist_upper = dice.log_uniform(1e-3, 2.0);
  }
  if (!dice.one_in(3)) {
    for (double* bound : {&limits.swing_lower[0], &limits.swing_lower[1], &limits.swing_upper[0]}) {
      *bound = dice.log_uniform(1e-2, 3.0);
    }
    limits.swing_upper[1] = dice.log_uniform(1e-2, 3.0);
  }
  return limits;
}

Tie random_tie(Dice& dice, int bodies) {
  Tie tie;
  tie.body_a = dice.below(bodies);
  tie.body_b = dice.one_in(2) ? kWorld : dice.below(bodies);
  if (tie.body_b == tie.body_a) tie.body_b = kWorld;
  tie.point_a = dice.vector(0.2);
  tie.point_b = dice.vector(0.5);
  if (dice.one_in(2)) {
    tie.stiffness = dice.log_uniform(1.0, 1e7);
    tie.damping = dice.log_uniform(0.1, 1e4);
  }
  if (dice.one_in(2)) tie.max_force = dice.log_uniform(0.1, 1e4);
  tie.holds_rotation = dice.one_in(2);
  tie.rotation = dice.rotation(2.0);
  if (dice.one_in(2)) {
    tie.angular_stiffness = dice.log_uniform(1e-2, 1e5);
    tie.angular_damping = dice.log_uniform(1e-3, 1e2);
  }
  if (dice.one_in(2)) tie.max_torque = dice.log_uniform(1e-2, 1e3);
  return tie;
}

Drive random_drive(Dice& dice, int bodies) {
  Drive drive;
  drive.body = dice.below(bodies);
  drive.stiffness = dice.one_in(6) ? 0.0 : dice.log_uniform(1e-2, 1e9);
  drive.damping = dice.one_in(4) ? 0.0 : dice.log_uniform(1e-4, 1e3);
  if (dice.one_in(2)) drive.max_torque = dice.one_in(8) ? 0.0 : dice.log_uniform(1e-3, 1e4);
  drive.target_rotation = dice.rotation(3.0);
  if (dice.one_in(3)) drive.target_velocity = dice.vector(dice.log_uniform(0.1, 1e2));
  return drive;
}

collision::Shape random_shape(Dice& dice) {
  const double size = dice.log_uniform(5e-3, 0.1);
  switch (dice.below(3)) {
    case 0:
      return collision::Sphere{.radius = size};
    case 1:
      return collision::Capsule{.radius = size, .half_length = size * dice.uniform(0.0, 4.0)};
    default: {
      collision::ConvexHull hull;
      for (int k = 4 + dice.below(9); k > 0; --k) hull.vertices.push_back(dice.vector(size));
      return hull;
    }
  }
}

/// Shapes about the coms of some bodies, and mostly a floor: under the bodies, or through them.
void add_shapes(Dice& dice, StressScene& scene) {
  constexpr int kMostShapes = 6;
  const auto& bodies = scene.definition.model.bodies;
  for (int i = 0; i < static_cast<int>(bodies.size()); ++i) {
    if (static_cast<int>(scene.definition.shapes.size()) == kMostShapes) break;
    if (dice.one_in(2)) continue;
    collision::ShapeDefinition shape;
    shape.name = bodies[i].name;
    shape.shape = random_shape(dice);
    shape.body = i;
    shape.X_BS = {.rotation = dice.rotation(2.0), .position = bodies[i].com};
    shape.friction = dice.one_in(4) ? 0.0 : dice.uniform(0.0, 1.5);
    scene.definition.shapes.push_back(shape);
  }
  if (dice.one_in(4)) return;
  collision::ShapeDefinition floor;
  floor.name = "floor";
  floor.shape = collision::Plane{};
  floor.X_BS.position.z() = -dice.uniform(0.2, 2.0);
  scene.definition.shapes.push_back(floor);
}

/// What acts beside joints, loads and couplings.
void add_rows(Dice& dice, StressScene& scene) {
  const int bodies = static_cast<int>(scene.definition.model.bodies.size());
  if (dice.one_in(4)) add_shapes(dice, scene);
  if (dice.one_in(6)) {
    for (int k = 1 + dice.below(3); k > 0; --k) scene.ties.push_back(random_tie(dice, bodies));
  }
  if (dice.one_in(3)) {
    for (BodyDefinition& body : scene.definition.model.bodies) {
      if (dice.one_in(2)) body.limits = random_limits(dice, body.rotation);
    }
  }
  if (dice.one_in(3)) {
    for (int k = 1 + dice.below(4); k > 0; --k) scene.drives.push_back(random_drive(dice, bodies));
  }
  if (dice.one_in(3)) scene.softness = dice.one_in(4) ? 0.0 : dice.log_uniform(1e-3, 1e3);
  // Large angles, so that something sleeps in a dozen steps.
  if (dice.one_in(3)) scene.sleep_angle = dice.log_uniform(1e-4, 1e2);
}

}  // namespace

StressScene random_scene(std::uint64_t seed) {
  Dice dice(seed);
  StressScene scene;
  scene.seed = seed;
  ModelDefinition& model = scene.definition.model;
  const int bodies = 1 + dice.below(24);
  for (int i = 0; i < bodies; ++i) model.bodies.push_back(random_body(dice, i));
  model.law = dice.one_in(2) ? FlowLaw::kPaper : FlowLaw::kOverstress;
  model.root = std::array{RootKind::kBall, RootKind::kFree, RootKind::kFixed}[dice.below(3)];
  if (dice.one_in(4)) model.gravity.setZero();
  scene.h = dice.log_uniform(1e-5, 0.1);
  scene.order = dice.one_in(4) ? 1 + dice.below(kMaxOrder) : 1;
  scene.spins.assign(bodies, Eigen::Vector3d::Zero());
  scene.forces.resize(bodies);
  if (dice.one_in(3)) scene.spins[dice.below(bodies)] = dice.vector(dice.log_uniform(1.0, 1e3));
  if (dice.one_in(3)) scene.forces[dice.below(bodies)].force = dice.vector(dice.log_uniform(1.0, 1e6));
  for (int k = dice.below(3); k > 0; --k) scene.couplings.push_back(random_coupling(dice, bodies));
  if (dice.one_in(3)) scene.teleport = dice.vector(10.0);
  add_rows(dice, scene);
  return scene;
}

}  // namespace layfigure::testing
