#include "small_doll.h"

#include <string>

namespace layfigure::testing {
namespace {

constexpr double kLength = 0.2;  // [m] of a bone
constexpr double kHeight = 1.0;  // [m] of the doll above the ground
constexpr int kBodies = 3;

character::Rig small_rig() {
  character::Rig rig;
  rig.name = "small";
  rig.source_file = "small.glb";
  rig.content_hash = 0xfedcba9876543210;  // negative as a signed number
  int index = 0;
  for (const char* name : {"hips", "spine", "arm", "tip"}) {
    character::Bone bone;
    bone.name = name;
    bone.parent = index - 1;
    bone.rest.translation() = index == 0 ? Eigen::Vector3d(0, 0, kHeight) : Eigen::Vector3d(kLength, 0, 0);
    bone.bind.translation() = Eigen::Vector3d(kLength * index, 0, kHeight);
    rig.bones.push_back(bone);
    ++index;
  }
  return rig;
}

character::SkinnedMesh small_mesh() {
  character::SkinnedMesh mesh;
  mesh.name = "strip";
  for (int i = 0; i <= kBodies; ++i) {
    for (const double y : {-0.02, 0.02}) {
      mesh.vertices.emplace_back(kLength * i, y, kHeight);
      if (i == 0) {
        mesh.influences.push_back({{0, 1.0}});
      } else {
        mesh.influences.push_back({{i - 1, 0.75}, {i, 0.25}});
      }
    }
  }
  for (int i = 0; i < 2 * kBodies; ++i) mesh.triangles.emplace_back(i, i + 1, i + 2);
  return mesh;
}

dynamics::BodyDefinition small_body(int index) {
  dynamics::BodyDefinition body;
  body.name = "body" + std::to_string(index);
  body.parent = index - 1;
  body.anchor = index == 0 ? Eigen::Vector3d(0, 0, kHeight) : Eigen::Vector3d(kLength, 0, 0);
  body.mass = 0.2;
  body.com = {0.5 * kLength, 0, 0};
  body.inertia = Eigen::Vector3d(1e-4, 7e-4, 7e-4).asDiagonal();
  body.joint = {.stiffness = 40.0, .damping = 0.4, .flow_damping = 2.0, .yield_torque = 3.0};
  return body;
}

}  // namespace

doll::Doll small_doll() {
  doll::Doll doll;
  doll.rig = small_rig();
  doll.rig.meshes.push_back(small_mesh());
  for (int i = 0; i < kBodies; ++i) doll.definition.bodies.push_back(small_body(i));
  for (const auto& body : doll.definition.bodies) doll.chosen_joints.push_back({body.joint, body.limits});
  doll.definition.root = dynamics::RootKind::kFree;
  doll.root_pin = {.stiffness = 1e4, .damping = 100.0, .angular_stiffness = 100.0, .angular_damping = 2.0};
  doll.body_of_bone = {0, 1, 2, -1};
  doll.bone_of_body = {0, 1, 2};
  for (int body = 0; body < kBodies; ++body) doll.carriers.push_back({body, Eigen::Isometry3d::Identity()});
  doll.carriers.push_back({kBodies - 1, Eigen::Isometry3d(Eigen::Translation3d(kLength, 0, 0))});
  doll.sections.resize(kBodies);
  return doll;
}

}  // namespace layfigure::testing
