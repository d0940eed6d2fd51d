#include "touching_scenes.h"

#include <algorithm>
#include <cmath>

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kCube = 0.1;  // edge [m]

BodyDefinition& add_capsule(scene::SceneDefinition& definition, const char* name, int parent,
                            const Eigen::Vector3d& anchor, const Eigen::Vector3d& tip, double radius) {
  BodyDefinition& body = definition.model.bodies.emplace_back();
  const double length = tip.norm();
  body.name = name;
  body.parent = parent;
  body.anchor = anchor;
  body.com = 0.5 * tip;
  body.mass = 1000.0 * M_PI * radius * radius * length;
  const double across = body.mass * (length * length / 12.0 + radius * radius / 4.0);
  const Eigen::Vector3d axis = tip / length;
  body.inertia =
      across * Eigen::Matrix3d::Identity() + (0.5 * body.mass * radius * radius - across) * axis * axis.transpose();
  collision::ShapeDefinition& shape = definition.shapes.emplace_back();
  shape.name = name;
  shape.body = static_cast<int>(definition.model.bodies.size()) - 1;
  shape.shape = collision::Capsule{.radius = radius, .half_length = 0.5 * length - 0.5 * radius};
  shape.X_BS.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis);
  shape.X_BS.position = body.com;
  return body;
}

}  // namespace

collision::ShapeDefinition floor_shape(double friction) {
  collision::ShapeDefinition shape;
  shape.name = "floor";
  shape.shape = collision::Plane{};
  shape.friction = friction;
  return shape;
}

collision::ShapeDefinition box_shape(const BodyDefinition& body, int index, const Eigen::Vector3d& half_size,
                                     double friction) {
  collision::ConvexHull hull;
  for (int k = 0; k < 8; ++k) {
    hull.vertices.emplace_back((k & 1) != 0 ? half_size.x() : -half_size.x(),
                               (k & 2) != 0 ? half_size.y() : -half_size.y(),
                               (k & 4) != 0 ? half_size.z() : -half_size.z());
  }
  collision::ShapeDefinition shape;
  shape.name = body.name;
  shape.shape = std::move(hull);
  shape.body = index;
  shape.X_BS.position = body.com;
  shape.friction = friction;
  return shape;
}

scene::SceneDefinition stack(int cubes, double gap, double friction) {
  scene::SceneDefinition definition;
  definition.model.root = RootKind::kFree;
  definition.shapes.push_back(floor_shape(friction));
  for (int k = 0; k < cubes; ++k) {
    BodyDefinition& body = definition.model.bodies.emplace_back();
    body.name = "cube " + std::to_string(k);
    body.anchor = {0.0, 0.0, 0.5 * kCube + gap + k * (kCube + gap)};
    body.mass = 1.0;
    body.inertia = kCube * kCube / 6.0 * Eigen::Matrix3d::Identity();
    definition.shapes.push_back(box_shape(body, k, Eigen::Vector3d::Constant(0.5 * kCube), friction));
  }
  return definition;
}

scene::SceneDefinition capsule_doll(double height, double yield_torque) {
  scene::SceneDefinition definition;
  definition.model.root = RootKind::kFree;
  definition.shapes.push_back(floor_shape(0.6));
  add_capsule(definition, "pelvis", -1, {0.0, 0.0, height}, {0.0, 0.0, 0.12}, 0.06);
  add_capsule(definition, "chest", 0, {0.0, 0.0, 0.12}, {0.0, 0.02, 0.25}, 0.07);
  add_capsule(definition, "head", 1, {0.0, 0.02, 0.27}, {0.0, 0.0, 0.16}, 0.06);
  for (const double side : {-1.0, 1.0}) {
    const int arm = static_cast<int>(definition.model.bodies.size());
    add_capsule(definition, side < 0.0 ? "right arm" : "left arm", 1, {0.12 * side, 0.0, 0.22},
                {0.25 * side, 0.0, -0.05}, 0.03);
    add_capsule(definition, side < 0.0 ? "right forearm" : "left forearm", arm, {0.25 * side, 0.0, -0.05},
                {0.22 * side, 0.03, 0.0}, 0.025);
    const int leg = static_cast<int>(definition.model.bodies.size());
    add_capsule(definition, side < 0.0 ? "right thigh" : "left thigh", 0, {0.07 * side, 0.0, 0.0},
                {0.03 * side, 0.05, -0.38}, 0.05);
    add_capsule(definition, side < 0.0 ? "right shin" : "left shin", leg, {0.03 * side, 0.05, -0.38},
                {0.0, -0.05, -0.36}, 0.04);
  }
  for (BodyDefinition& body : definition.model.bodies) {
    body.joint.stiffness = 60.0;
    body.joint.damping = 0.6;
    body.joint.flow_damping = 0.5;
    body.joint.yield_torque = yield_torque;
    body.limits.twist_lower = -1.0;
    body.limits.twist_upper = 1.0;
    body.limits.swing_lower = body.limits.swing_upper = {1.2, 1.5};
  }
  // Siblings that overlap at their common joint.
  definition.excluded = {{0, 3}, {0, 7}, {2, 3}, {2, 7}, {5, 9}};
  return definition;
}

double overlap(scene::Scene& scene, const State& state) {
  // A step of no length moves nothing and finds the contacts.
  State copy = state;
  (void)scene.step(copy, {}, {.step = 1e-12});
  double deepest = 0.0;
  for (const collision::ContactPoint& point : scene.contacts()) deepest = std::max(deepest, -point.gap);
  return deepest;
}

}  // namespace layfigure::testing
