#include "fixture.h"

#include <array>

namespace layfigure::skinning::test {

using Eigen::Isometry3d;
using Eigen::Vector3d;

character::Rig cube_rig() {
  character::Rig rig;
  rig.bones.emplace_back().name = "core";
  character::SkinnedMesh& mesh = rig.meshes.emplace_back();
  mesh.name = "cube";
  for (int i = 0; i < 8; ++i) {  // bit b of i says on which side in axis b
    mesh.vertices.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    mesh.influences.push_back({{0, 1.0}});
  }
  for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
                                   std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}}) {
    mesh.triangles.emplace_back(a, b, c);
    mesh.triangles.emplace_back(a, c, d);
  }
  return rig;
}

Isometry3d odd_motion() {
  return Eigen::Translation3d(0.3, -0.7, 1.1) * Eigen::AngleAxisd(2.1, Vector3d(1, -2, 0.5).normalized());
}

std::vector<Isometry3d> random_poses(const Skin& skin, double angle, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> turn(-angle, angle);
  std::vector<Isometry3d> X_WB;
  for (const character::Bone& bone : skin.bones()) {
    const Vector3d axis = random_vector(generator, 1.0).normalized();
    const Isometry3d X_PB = bone.rest * Eigen::AngleAxisd(turn(generator), axis);
    X_WB.push_back(bone.parent < 0 ? odd_motion() * X_PB : X_WB[bone.parent] * X_PB);
  }
  return X_WB;
}

std::vector<Isometry3d> bind_poses(const Skin& skin) {
  std::vector<Isometry3d> X_WB;
  for (const character::Bone& bone : skin.bones()) X_WB.push_back(bone.bind);
  return X_WB;
}

Deformed deformed(const Skin& skin, const std::vector<Isometry3d>& X_WB, Blend blend) {
  DeformWorkspace workspace(skin);
  Deformed result;
  result.positions.resize(skin.vertex_count());
  result.normals.resize(skin.vertex_count());
  deform(skin, X_WB, blend, workspace, result.positions, result.normals);
  return result;
}

}  // namespace layfigure::skinning::test
