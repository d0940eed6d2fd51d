#include "skin.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <unordered_set>

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

/// Of a vertex' position and influences. -0 and 0 are equal, so they have one hash.
struct VertexHash {
  const SkinnedMesh& mesh;

  std::size_t operator()(int vertex) const {
    std::uint64_t hash = 0;
    const auto mix = [&](std::uint64_t value) {
      hash = (hash ^ value) * 0x9E3779B97F4A7C15ULL;  // Fibonacci hashing, and the high bits brought down
      hash ^= hash >> 32U;
    };
    for (const double x : mesh.vertices[vertex]) mix(std::bit_cast<std::uint64_t>(x + 0.0));
    for (const Influence& i : mesh.influences[vertex]) {
      mix(static_cast<std::uint64_t>(i.bone));
      mix(std::bit_cast<std::uint64_t>(i.weight));
    }
    return hash;
  }
};

struct VertexEqual {
  const SkinnedMesh& mesh;

  bool operator()(int a, int b) const {
    const auto same = [](const Influence& i, const Influence& j) { return i.bone == j.bone && i.weight == j.weight; };
    return mesh.vertices[a] == mesh.vertices[b] &&
           std::equal(mesh.influences[a].begin(), mesh.influences[a].end(), mesh.influences[b].begin(),
                      mesh.influences[b].end(), same);
  }
};

SkinnedMesh make_mesh(const SourceMesh& source, const Eigen::Affine3d& X_WM, const Skeleton& skeleton,
                      std::vector<std::string>& warnings) {
  SkinnedMesh mesh;
  mesh.name = source.name;
  mesh.color = source.color;
  mesh.vertices.reserve(source.vertices.size());
  for (const auto& vertex : source.vertices) mesh.vertices.emplace_back(X_WM * vertex);
  mesh.triangles = source.triangles;
  if (X_WM.linear().determinant() < 0.0) {  // mirrored
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
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
  }
  warnings.emplace_back("the triangles face inwards: turned round");
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
    }
  }
  mend_winding(meshes, warnings);
  return meshes;
}

void weld(SkinnedMesh& mesh) {
  // The vertices kept so far are the first ones of the mesh; the next candidate is put behind them and looked up there.
  std::unordered_set<int, VertexHash, VertexEqual> known(mesh.vertices.size(), VertexHash{mesh}, VertexEqual{mesh});
  std::vector<int> joined(mesh.vertices.size());
  int kept = 0;
  for (std::size_t vertex = 0; vertex < mesh.vertices.size(); ++vertex) {
    std::swap(mesh.vertices[kept], mesh.vertices[vertex]);
    std::swap(mesh.influences[kept], mesh.influences[vertex]);
    const auto [entry, is_new] = known.insert(kept);
    joined[vertex] = *entry;
    if (is_new) ++kept;
  }
  mesh.vertices.resize(kept);
  mesh.influences.resize(kept);
  for (auto& triangle : mesh.triangles) triangle = {joined[triangle[0]], joined[triangle[1]], joined[triangle[2]]};
  std::erase_if(mesh.triangles, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
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
