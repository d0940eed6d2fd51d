#include "rig_fixture.h"

#include <cmath>
#include <numbers>

namespace layfigure::doll::test {
namespace {

using character::Bone;
using character::Influence;
using character::Rig;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Y along the prism's Z.
const Eigen::Matrix3d kBoneAxes = (Eigen::Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();

void add_bone(Rig& rig, const std::string& name, int parent, const Isometry3d& bind) {
  Bone bone;
  bone.name = name;
  bone.parent = parent;
  bone.bind = bind;
  bone.rest = parent < 0 ? bind : rig.bones[parent].bind.inverse() * bind;
  rig.bones.push_back(bone);
}

std::vector<Influence> ring_influences(const Prism& prism, int first_bone, int ring) {
  const int bone = ring / prism.rings_per_bone;
  const bool at_joint = ring % prism.rings_per_bone == 0 && bone > 0 && bone < prism.bones;
  if (at_joint) return {{first_bone + bone - 1, 0.5}, {first_bone + bone, 0.5}};
  return {{first_bone + std::min(bone, prism.bones - 1), 1.0}};
}

}  // namespace

double Prism::side() const { return 2.0 * radius * std::sin(std::numbers::pi / sides); }

double Prism::area() const { return 0.5 * sides * radius * radius * std::sin(2.0 * std::numbers::pi / sides); }

double Prism::second_moment() const { return area() / 24.0 * (6.0 * radius * radius - side() * side()); }

void add_prism(Rig& rig, const Prism& prism, int parent) {
  const int first_bone = static_cast<int>(rig.bones.size());
  for (int b = 0; b < prism.bones; ++b) {
    Isometry3d bind = prism.pose * Eigen::Translation3d(0, 0, b * prism.bone_length);
    bind.linear() = prism.pose.linear() * kBoneAxes;
    add_bone(rig, prism.prefix + std::to_string(b), b == 0 ? parent : first_bone + b - 1, bind);
  }
  character::SkinnedMesh mesh;
  mesh.name = prism.prefix;
  const int rings = prism.bones * prism.rings_per_bone;
  for (int ring = 0; ring <= rings; ++ring) {
    for (int k = 0; k < prism.sides; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / prism.sides;
      const double z = ring * prism.bone_length / prism.rings_per_bone;
      mesh.vertices.push_back(prism.pose * Vector3d(prism.radius * std::cos(angle), prism.radius * std::sin(angle), z));
      mesh.influences.push_back(ring_influences(prism, first_bone, ring));
      if (ring == rings) continue;
      const int a = ring * prism.sides + k;
      const int b = ring * prism.sides + (k + 1) % prism.sides;
      mesh.triangles.emplace_back(a, b, b + prism.sides);
      mesh.triangles.emplace_back(a, b + prism.sides, a + prism.sides);
    }
  }
  for (int k = 1; k + 1 < prism.sides; ++k) {
    const int top = rings * prism.sides;
    mesh.triangles.emplace_back(0, k + 1, k);
    mesh.triangles.emplace_back(top, top + k, top + k + 1);
  }
  rig.meshes.push_back(mesh);
}

Rig make_prism(const Prism& prism) {
  Rig rig;
  rig.name = "prism";
  rig.source_file = "prism.glb";
  add_prism(rig, prism, -1);
  return rig;
}

Rig moved(Rig rig, const Isometry3d& motion) {
  for (Bone& bone : rig.bones) {
    bone.bind = motion * bone.bind;
    if (bone.parent < 0) bone.rest = motion * bone.rest;
  }
  for (auto& mesh : rig.meshes) {
    for (auto& vertex : mesh.vertices) vertex = motion * vertex;
  }
  return rig;
}

Rig mirrored(Rig rig) {
  const Eigen::DiagonalMatrix<double, 3> flip(-1.0, 1.0, 1.0);
  const auto mirror = [&](Isometry3d& pose) {
    pose.translation() = flip * pose.translation();
    pose.linear() = flip * pose.linear() * flip;
  };
  for (Bone& bone : rig.bones) {
    mirror(bone.bind);
    mirror(bone.rest);
  }
  for (auto& mesh : rig.meshes) {
    for (auto& vertex : mesh.vertices) vertex = flip * vertex;
    for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  }
  return rig;
}

Rig scaled(Rig rig, double factor) {
  for (Bone& bone : rig.bones) {
    bone.bind.translation() *= factor;
    bone.rest.translation() *= factor;
  }
  for (auto& mesh : rig.meshes) {
    for (auto& vertex : mesh.vertices) vertex *= factor;
  }
  return rig;
}

Rig make_flat_adult() {
  constexpr double kFlatness = 0.5;
  constexpr double kSlope = 0.4;    // of the arms' flat sides
  constexpr double kHeight = 1.45;  // of the arms [m]
  Rig rig = make_adult();
  for (auto& vertex : rig.meshes[0].vertices) vertex.y() *= kFlatness;
  for (const int arm : {1, 2}) {
    for (auto& vertex : rig.meshes[arm].vertices) {
      vertex.y() = kFlatness * vertex.y() + kSlope * (vertex.z() - kHeight);
    }
  }
  return rig;
}

Rig make_adult() {
  Rig rig = make_prism({.prefix = "trunk",
                        .bones = 2,
                        .sides = 24,
                        .radius = 0.13,
                        .pose = Isometry3d(Eigen::Translation3d(0, 0, 1.0))});
  for (const double side : {1.0, -1.0}) {
    Prism arm{.prefix = side > 0 ? "left" : "right", .bones = 3, .bone_length = 0.26, .sides = 16, .radius = 0.045};
    arm.pose =
        Eigen::Translation3d(side * 0.16, 0, 1.45) * Eigen::AngleAxisd(side * std::numbers::pi / 2, Vector3d::UnitY());
    add_prism(rig, arm, 1);
  }
  return rig;
}

DollSettings without_minima() {
  DollSettings settings;
  settings.density = 1e-3;  // no weight to speak of
  settings.largest_sag = 1.0;
  settings.largest_strain = std::numbers::pi;
  settings.hold_margin = 1.0;
  settings.damping_ratio = 0.0;
  settings.largest_flow_rate = 1e6;
  return settings;
}

Isometry3d odd_motion() {
  return Eigen::Translation3d(-3.0, 7.0, 2.0) * Eigen::AngleAxisd(2.1, Vector3d(1, -2, 0.5).normalized());
}

}  // namespace layfigure::doll::test
