#pragma once

#include "stress_scene.h"

/// The fields of a scene and of all that it is made of, each listed once: visit(name, field) for what writes them and
/// for what reads them.
namespace layfigure::testing {

template <class Visitor>
void fields(Visitor& visit, dynamics::JointShape& shape) {
  visit("axes", shape.axes);
  visit("stiffness", shape.stiffness);
  visit("damping", shape.damping);
  visit("yield", shape.yield);
  visit("locked", shape.locked);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::JointLaw& law) {
  visit("stiffness", law.stiffness);
  visit("damping", law.damping);
  visit("flow_damping", law.flow_damping);
  visit("yield_torque", law.yield_torque);
  visit("hardening", law.hardening);
  visit("shape", law.shape);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::JointLimits& limits) {
  visit("axes", limits.axes);
  visit("reference", limits.reference);
  visit("twist_lower", limits.twist_lower);
  visit("twist_upper", limits.twist_upper);
  visit("swing_lower", limits.swing_lower);
  visit("swing_upper", limits.swing_upper);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::BodyDefinition& body) {
  visit("name", body.name);
  visit("parent", body.parent);
  visit("anchor", body.anchor);
  visit("rotation", body.rotation);
  visit("rest_rotation", body.rest_rotation);
  visit("mass", body.mass);
  visit("com", body.com);
  visit("inertia", body.inertia);
  visit("joint", body.joint);
  visit("limits", body.limits);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::ModelDefinition& model) {
  visit("law", model.law);
  visit("root", model.root);
  visit("gravity", model.gravity);
  visit("bodies", model.bodies);
}
template <class Visitor>
void fields(Visitor& visit, collision::Pose& pose) {
  visit("rotation", pose.rotation);
  visit("position", pose.position);
}
template <class Visitor>
void fields(Visitor& visit, collision::Sphere& sphere) {
  visit("radius", sphere.radius);
}
template <class Visitor>
void fields(Visitor& visit, collision::Capsule& capsule) {
  visit("radius", capsule.radius);
  visit("half_length", capsule.half_length);
}
template <class Visitor>
void fields(Visitor& visit, collision::ConvexHull& hull) {
  visit("vertices", hull.vertices);
}
template <class Visitor>
void fields(Visitor&, collision::Plane&) {}
template <class Visitor>
void fields(Visitor& visit, collision::ShapeDefinition& shape) {
  visit("name", shape.name);
  visit("shape", shape.shape);
  visit("body", shape.body);
  visit("X_BS", shape.X_BS);
  visit("friction", shape.friction);
  visit("group", shape.group);
}
template <class Visitor>
void fields(Visitor& visit, scene::SceneDefinition& definition) {
  visit("model", definition.model);
  visit("shapes", definition.shapes);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::BodyForce& force) {
  visit("force", force.force);
  visit("torque", force.torque);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::Coupling& coupling) {
  visit("body", coupling.body);
  visit("point", coupling.point);
  visit("orientation", coupling.orientation);
  visit("stiffness", coupling.stiffness);
  visit("damping", coupling.damping);
  visit("angular_stiffness", coupling.angular_stiffness);
  visit("angular_damping", coupling.angular_damping);
  visit("target_position", coupling.target_position);
  visit("target_rotation", coupling.target_rotation);
  visit("target_velocity", coupling.target_velocity);
  visit("target_angular_velocity", coupling.target_angular_velocity);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::Tie& tie) {
  visit("body_a", tie.body_a);
  visit("body_b", tie.body_b);
  visit("point_a", tie.point_a);
  visit("point_b", tie.point_b);
  visit("stiffness", tie.stiffness);
  visit("damping", tie.damping);
  visit("max_force", tie.max_force);
  visit("holds_rotation", tie.holds_rotation);
  visit("rotation", tie.rotation);
  visit("angular_stiffness", tie.angular_stiffness);
  visit("angular_damping", tie.angular_damping);
  visit("max_torque", tie.max_torque);
}
template <class Visitor>
void fields(Visitor& visit, dynamics::Drive& drive) {
  visit("body", drive.body);
  visit("stiffness", drive.stiffness);
  visit("damping", drive.damping);
  visit("max_torque", drive.max_torque);
  visit("target_rotation", drive.target_rotation);
  visit("target_velocity", drive.target_velocity);
}
template <class Visitor>
void fields(Visitor& visit, StressScene& scene) {
  visit("seed", scene.seed);
  visit("h", scene.h);
  visit("steps", scene.steps);
  visit("order", scene.order);
  visit("softness", scene.softness);
  visit("sleep_angle", scene.sleep_angle);
  visit("teleport", scene.teleport);
  visit("spins", scene.spins);
  visit("forces", scene.forces);
  visit("couplings", scene.couplings);
  visit("ties", scene.ties);
  visit("drives", scene.drives);
  visit("definition", scene.definition);
}

}  // namespace layfigure::testing
