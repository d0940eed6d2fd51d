#include "skin.h"

#include <Eigen/LU>
#include <algorithm>
#include <numeric>
#include <tuple>

#include "normals.h"
#include "weld.h"

namespace layfigure::character {
namespace {

/// Lighter influences are rounding: 1e-6 of a 1 m lever is a micrometre.
constexpr double kLeastWeight = 1e-6;

/// Makes the weights of one vertex sum to 1, heaviest first. False if there is none.
bool normalise(std::vector<Influence>& influences) {
  std::erase_if(influences, [](const Influence& i) { return !(i.weight > 0.0); });
  double total = 0.0;
  for (const Influence& i : influences) total += i.weight;
  if (!(total > 0.0)) return false;
  std::erase_if(influences, [&](const Influence& i) { return i.weight < kLeastWeight * total; });
  total = std::accumulate(influences.begin(), influences.end(), 0.0,
                          [](double sum, const Influence& i) { return sum + i.weight; });
  for (Influence& i : influences) i.weight /= total;
  std::sort(influences.begin(), influences.end(), [](const Influence& a, const Influence& b) {
    return std::tuple(-a.weight, a.bone) < std::tuple(-b.weight, b.bone);
  });
  return true;
}

/// One list per vertex; several joints of the file may be one bone, so their weights are added.
std::vector<std::vector<Influence>> gather(const SourceMesh& source, const Skeleton& skeleton) {
  std::vector<std::vector<Influence>> influences(source.vertices.size());
  for (const SourceJoint& joint : source.joints) {
    const int bone = skeleton.bone_of_node[joint.node];
    for (const auto& weight : joint.weights) {
      auto& list = influences[weight.vertex];
      const auto same = std::find_if(list.begin(), list.end(), [&](const Influence& i) { return i.bone == bone; });
      if (same == list.end()) {
        list.push_back({bone, weight.weight});
      } else {
        same->weight += weight.weight;
      }
    }
  }
  return influences;
}

void add_influences(const SourceMesh& source, const Skeleton& skeleton, SkinnedMesh& mesh,
                    std::vector<std::string>& warnings) {
  mesh.influences = gather(source, skeleton);
  const int follows = std::max(0, skeleton.bone_of_node[source.node]);
  int unweighted = 0;
  for (auto& influences : mesh.influences) {
    if (normalise(influences)) continue;
    influences = {{follows, 1.0}};
    ++unweighted;
  }
  if (unweighted > 0 && !source.joints.empty()) {
    warnings.push_back("mesh '" + source.name + "': " + std::to_string(unweighted) +
                       " vertices have no weight and follow bone '" + skeleton.bones[follows].name + "'");
  }
}

/// Texture coordinates that are not finite become 0, for want of better ones.
void mend_uvs(SkinnedMesh& mesh, std::vector<std::string>& warnings) {
  std::size_t mended = 0;
  for (Eigen::Vector2f& uv : mesh.wedges.uvs) {
    if (uv.allFinite()) continue;
    uv.setZero();
    ++mended;
  }
  if (mended == 0) return;
  warnings.push_back("mesh '" + mesh.name + "': " + std::to_string(mended) +
                     " texture coordinates are not finite: taken as 0");
}

SkinnedMesh make_mesh(const SourceMesh& source, const Eigen::Affine3d& X_WM, const Skeleton& skeleton,
                      std::vector<std::string>& warnings) {
  SkinnedMesh mesh;
  mesh.name = source.name;
  mesh.material = source.material;
  mesh.vertices.reserve(source.vertices.size());
  for (const auto& vertex : source.vertices) mesh.vertices.emplace_back(X_WM * vertex);
  mesh.triangles = source.triangles;
  if (X_WM.linear().determinant() < 0.0) {  // mirrored
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  const Eigen::Matrix3d turn = normal_map(X_WM.linear());
  for (const auto& normal : source.normals) mesh.wedges.normals.push_back(unit_or_zero(turn * normal));
  mesh.wedges.uvs = source.uvs;
  mend_uvs(mesh, warnings);
  add_influences(source, skeleton, mesh, warnings);
  weld(mesh);
  return mesh;
}

void mend_winding(std::vector<SkinnedMesh>& meshes, std::vector<std::string>& warnings) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (const SkinnedMesh& mesh : meshes) {
    for (const auto& vertex : mesh.vertices) middle += vertex;
    count += mesh.vertices.size();
  }
  if (count == 0) return;
  middle /= static_cast<double>(count);
  double volume6 = 0.0;
  for (const SkinnedMesh& mesh : meshes) volume6 += signed_volume6(mesh, middle);
  if (volume6 >= 0.0) return;
  for (SkinnedMesh& mesh : meshes) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    for (auto& triangle : mesh.wedges.triangles) std::swap(triangle[1], triangle[2]);
  }
  warnings.emplace_back("the triangles face inwards: turned round");
  double facing = 0.0;
  for (const SkinnedMesh& mesh : meshes) facing += facing_area(mesh);
  if (facing >= 0.0) return;
  for (SkinnedMesh& mesh : meshes) {
    for (auto& normal : mesh.wedges.normals) normal = -normal;
  }
}

}  // namespace

std::vector<SkinnedMesh> make_meshes(const SourceScene& scene, const Skeleton& skeleton,
                                     std::vector<std::string>& warnings) {
  std::vector<SkinnedMesh> meshes;
  for (std::size_t index = 0; index < scene.meshes.size(); ++index) {
    const SourceMesh& source = scene.meshes[index];
    if (source.triangles.empty()) {
      warnings.push_back("mesh '" + source.name + "' has no triangles: left out");
    } else if (source.joints.empty() && skeleton.bone_of_node[source.node] < 0) {
      warnings.push_back("mesh '" + source.name + "' is not skinned and hangs on no bone: left out");
    } else {
      meshes.push_back(make_mesh(source, skeleton.mesh_poses[index], skeleton, warnings));
      if (!meshes.back().triangles.empty()) continue;
      warnings.push_back("mesh '" + source.name + "' has no triangles with three different corners: left out");
      meshes.pop_back();
    }
  }
  mend_winding(meshes, warnings);
  for (SkinnedMesh& mesh : meshes) mend_normals(mesh, warnings);
  return meshes;
}

double signed_volume6(const SkinnedMesh& mesh, const Eigen::Vector3d& reference) {
  double volume6 = 0.0;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]] - reference;
    const Eigen::Vector3d b = mesh.vertices[triangle[1]] - reference;
    const Eigen::Vector3d c = mesh.vertices[triangle[2]] - reference;
    volume6 += a.dot(b.cross(c));
  }
  return volume6;
}

}  // namespace layfigure::character
