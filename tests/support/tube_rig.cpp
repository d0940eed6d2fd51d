#include "tube_rig.h"

#include <cmath>
#include <numbers>
#include <string>

namespace layfigure::testing {
namespace {

using character::Influence;

/// A bone's weight ends so many bone lengths from its middle.
constexpr double kReach = 1.75;

void add_bones(const Tube& tube, character::Rig& rig) {
  for (int b = 0; b < tube.bones; ++b) {
    character::Bone bone;
    bone.name = "bone" + std::to_string(b);
    bone.parent = b - 1;
    bone.bind = Eigen::Translation3d(0, 0, b * tube.bone_length) *
                Eigen::AngleAxisd(0.3 + b, Eigen::Vector3d(1, 2, 3).normalized());
    bone.rest = b == 0 ? bone.bind : rig.bones.back().bind.inverse() * bone.bind;
    rig.bones.push_back(bone);
  }
}

std::vector<Influence> influences_at(const Tube& tube, double z) {
  std::vector<Influence> influences;
  double sum = 0.0;
  for (int b = 0; b < tube.bones; ++b) {
    const double weight = kReach - std::abs(z / tube.bone_length - (b + 0.5));
    if (weight <= 0.0) continue;
    influences.push_back({b, weight * weight});
    sum += weight * weight;
  }
  for (Influence& i : influences) i.weight /= sum;
  return influences;
}

void add_vertex(const Tube& tube, const Eigen::Vector3d& vertex, character::SkinnedMesh& mesh) {
  mesh.vertices.push_back(vertex);
  mesh.influences.push_back(influences_at(tube, vertex.z()));
}

}  // namespace

character::Rig tube_rig(const Tube& tube) {
  character::Rig rig;
  rig.name = "tube";
  add_bones(tube, rig);
  character::SkinnedMesh& mesh = rig.meshes.emplace_back();
  mesh.name = "tube";
  const int rings = tube_rings(tube);
  for (int ring = 0; ring < rings; ++ring) {
    const double z = ring * tube.bone_length / tube.rings_per_bone;
    for (int k = 0; k < tube.sides; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / tube.sides;
      add_vertex(tube, {tube.radius * std::cos(angle), tube.radius * std::sin(angle), z}, mesh);
    }
  }
  const int bottom = rings * tube.sides;
  const int top = bottom + 1;
  add_vertex(tube, {0, 0, 0}, mesh);
  add_vertex(tube, {0, 0, tube.bones * tube.bone_length}, mesh);
  for (int k = 0; k < tube.sides; ++k) {
    const int next = (k + 1) % tube.sides;
    mesh.triangles.emplace_back(bottom, tube_vertex(tube, 0, next), tube_vertex(tube, 0, k));
    mesh.triangles.emplace_back(top, tube_vertex(tube, rings - 1, k), tube_vertex(tube, rings - 1, next));
    for (int ring = 0; ring + 1 < rings; ++ring) {
      const int a = tube_vertex(tube, ring, k);
      const int b = tube_vertex(tube, ring, next);
      mesh.triangles.emplace_back(a, b, b + tube.sides);
      mesh.triangles.emplace_back(a, b + tube.sides, a + tube.sides);
    }
  }
  return rig;
}

}  // namespace layfigure::testing
