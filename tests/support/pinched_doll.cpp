#include "pinched_doll.h"

#include "small_doll.h"

namespace layfigure::testing {
namespace {

collision::ShapeDefinition limb(int body, double radius, double half_length, const Eigen::Vector3d& middle) {
  collision::ShapeDefinition shape;
  shape.shape = collision::Capsule{.radius = radius, .half_length = half_length};
  shape.body = body;
  shape.X_BS.position = middle;
  shape.X_BS.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  return shape;
}

}  // namespace

doll::Doll pinched_limb(double off_center) {
  doll::Doll doll;
  character::Bone bone;
  bone.name = "limb";
  bone.parent = -1;
  bone.rest.translation() = bone.bind.translation() = Eigen::Vector3d(0, 0, 1);
  doll.rig.bones.push_back(bone);
  dynamics::BodyDefinition body;
  body.name = "limb";
  body.anchor = {0, 0, 1};
  body.mass = kLimbMass;
  body.com = {off_center, 0, 0};
  body.inertia = Eigen::Vector3d(1.35e-4, 1e-3, 1e-3).asDiagonal();
  doll.definition.bodies.push_back(body);
  doll.definition.root = dynamics::RootKind::kFree;
  doll.body_of_bone = {0};
  doll.bone_of_body = {0};
  doll.carriers.push_back({0, Eigen::Isometry3d::Identity()});
  doll.sections.resize(1);
  doll.shapes.push_back(limb(0, kLimbRadius, 0.07, Eigen::Vector3d::Zero()));
  return doll;
}

doll::Doll thick_doll() {
  doll::Doll doll = small_doll();
  for (const int body : {0, 1, 2}) {
    doll.shapes.push_back(limb(body, kLimbRadius, 0.06, doll.definition.bodies[body].com));
  }
  return doll;
}

}  // namespace layfigure::testing
