#include "unbound_skin.h"

#include <algorithm>

#include "normals.h"

namespace layfigure::character {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;

bool is_unbound(const SourceMesh& mesh) {
  return mesh.joints.size() > 1 && std::all_of(mesh.joints.begin(), mesh.joints.end(), [](const SourceJoint& joint) {
           return joint.offset.matrix() == Eigen::Matrix4d::Identity();
         });
}

void bind(const SourceScene& scene, SourceMesh& mesh) {
  std::vector<Vector3d> sums(mesh.vertices.size(), Vector3d::Zero());
  std::vector<Vector3d> normals(mesh.normals.size(), Vector3d::Zero());
  std::vector<double> totals(mesh.vertices.size(), 0.0);
  for (SourceJoint& joint : mesh.joints) {
    const Affine3d& X_FJ = scene.nodes[joint.node].pose;
    const Eigen::Matrix3d turn = normal_map(X_FJ.linear());
    for (const SourceJoint::Weight& weight : joint.weights) {
      if (!(weight.weight > 0.0)) continue;
      sums[weight.vertex] += weight.weight * (X_FJ * mesh.vertices[weight.vertex]);
      totals[weight.vertex] += weight.weight;
      if (!normals.empty()) normals[weight.vertex] += weight.weight * (turn * mesh.normals[weight.vertex]);
    }
    joint.offset = X_FJ.inverse();
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!(totals[v] > 0.0)) continue;
    mesh.vertices[v] = sums[v] / totals[v];
    if (!normals.empty()) mesh.normals[v] = normals[v];
  }
}

}  // namespace

void bind_unbound_skins(SourceScene& scene) {
  for (SourceMesh& mesh : scene.meshes) {
    if (!is_unbound(mesh)) continue;
    bind(scene, mesh);
    scene.warnings.push_back("mesh '" + mesh.name + "' has no bind matrices: bound as the file poses it");
  }
}

}  // namespace layfigure::character
