#include "layfigure/haptics/fingertip.h"

#include <algorithm>
#include <string>

namespace layfigure::haptics {
namespace {

std::string name_of(int pointer) { return "fingertip of pointer " + std::to_string(pointer); }

}  // namespace

double fingertip_mass(double doll_mass) { return std::min(kFingertipMass, kFingertipShare * doll_mass); }

dynamics::BodyDefinition fingertip_body(int pointer, const FingertipDefinition& fingertip, double mass,
                                        const PointerPose& pose) {
  dynamics::BodyDefinition body;
  body.name = name_of(pointer);
  body.anchor = pose.position;
  body.rotation = pose.rotation;
  body.rest_rotation = pose.rotation;
  body.mass = mass;
  body.inertia = (0.4 * mass * fingertip.radius * fingertip.radius) * Eigen::Matrix3d::Identity();  // a ball's
  return body;
}

collision::ShapeDefinition fingertip_shape(int pointer, const FingertipDefinition& fingertip, int body) {
  collision::ShapeDefinition shape;
  shape.name = name_of(pointer);
  shape.shape = collision::Sphere{.radius = fingertip.radius};
  shape.body = body;
  shape.friction = fingertip.friction;
  return shape;
}

dynamics::Coupling fingertip_coupling(double stiffness, double damping) {
  dynamics::Coupling coupling;
  coupling.stiffness = stiffness;
  coupling.damping = damping;
  coupling.angular_stiffness = kKnuckleDistance * kKnuckleDistance * stiffness;
  coupling.angular_damping = kKnuckleDistance * kKnuckleDistance * damping;
  return coupling;
}

}  // namespace layfigure::haptics
