#include "weld.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <unordered_set>

namespace layfigure::character {
namespace {

/// Numbers mixed into a hash: Fibonacci hashing, and the high bits brought down. -0 and 0 are equal, so they have one.
class Mixer {
 public:
  void add(std::uint64_t value) {
    hash_ = (hash_ ^ value) * 0x9E3779B97F4A7C15ULL;
    hash_ ^= hash_ >> 32U;
  }
  void add(int value) { add(static_cast<std::uint64_t>(value)); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value + 0.0)); }
  template <class Vector>
  void add_all(const Vector& vector) {
    for (const auto x : vector) add(static_cast<double>(x));
  }
  [[nodiscard]] std::size_t value() const { return hash_; }

 private:
  std::uint64_t hash_{0};
};

/// Of a vertex' position and influences.
struct VertexHash {
  const SkinnedMesh& mesh;

  std::size_t operator()(int vertex) const {
    Mixer mixer;
    mixer.add_all(mesh.vertices[vertex]);
    for (const Influence& i : mesh.influences[vertex]) {
      mixer.add(i.bone);
      mixer.add(i.weight);
    }
    return mixer.value();
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

/// Which of the old vertices became which of the new ones.
struct Joined {
  std::vector<int> vertex_of;  ///< per old vertex
  std::vector<int> first_of;   ///< per new vertex: the first old one that it is
};

Joined join_vertices(SkinnedMesh& mesh) {
  // The vertices kept so far are the first ones of the mesh; the next candidate is put behind them and looked up there.
  std::unordered_set<int, VertexHash, VertexEqual> known(mesh.vertices.size(), VertexHash{mesh}, VertexEqual{mesh});
  Joined joined;
  joined.vertex_of.resize(mesh.vertices.size());
  int kept = 0;
  for (std::size_t vertex = 0; vertex < mesh.vertices.size(); ++vertex) {
    std::swap(mesh.vertices[kept], mesh.vertices[vertex]);
    std::swap(mesh.influences[kept], mesh.influences[vertex]);
    const auto [entry, is_new] = known.insert(kept);
    joined.vertex_of[vertex] = *entry;
    if (!is_new) continue;
    joined.first_of.push_back(static_cast<int>(vertex));
    ++kept;
  }
  mesh.vertices.resize(kept);
  mesh.influences.resize(kept);
  return joined;
}

/// Of the wedge that an old vertex is: the new vertex, its normal and texture coordinate.
struct WedgeHash {
  const Joined& joined;
  const Wedges& wedges;

  std::size_t operator()(int old) const {
    Mixer mixer;
    mixer.add(joined.vertex_of[old]);
    if (!wedges.normals.empty()) mixer.add_all(wedges.normals[old]);
    if (!wedges.uvs.empty()) mixer.add_all(wedges.uvs[old]);
    return mixer.value();
  }
};

struct WedgeEqual {
  const Joined& joined;
  const Wedges& wedges;

  bool operator()(int a, int b) const {
    return joined.vertex_of[a] == joined.vertex_of[b] &&
           (wedges.normals.empty() || wedges.normals[a] == wedges.normals[b]) &&
           (wedges.uvs.empty() || wedges.uvs[a] == wedges.uvs[b]);
  }
};

template <class Value>
void choose(std::vector<Value>& values, const std::vector<int>& chosen) {
  if (values.empty()) return;
  std::vector<Value> result;
  result.reserve(chosen.size());
  for (const int index : chosen) result.push_back(values[index]);
  values = std::move(result);
}

std::vector<Eigen::Vector3i> renumbered(std::vector<Eigen::Vector3i> triangles, const std::vector<int>& number_of) {
  for (auto& t : triangles) t = {number_of[t[0]], number_of[t[1]], number_of[t[2]]};
  return triangles;
}

/// `triangles` are of old vertices.
void join_wedges(const Joined& joined, const std::vector<Eigen::Vector3i>& triangles, Wedges& wedges) {
  std::vector<int> wedge_of(joined.vertex_of.size());
  std::vector<int> chosen = joined.first_of;  // per wedge: the old vertex that it is
  {
    std::unordered_set<int, WedgeHash, WedgeEqual> known(wedge_of.size(), WedgeHash{joined, wedges},
                                                         WedgeEqual{joined, wedges});
    known.insert(chosen.begin(), chosen.end());
    for (std::size_t wedge = 0; wedge < chosen.size(); ++wedge) wedge_of[chosen[wedge]] = static_cast<int>(wedge);
    for (int old = 0; old < static_cast<int>(wedge_of.size()); ++old) {
      const auto [entry, is_new] = known.insert(old);
      if (is_new) chosen.push_back(old);
      wedge_of[old] = is_new ? static_cast<int>(chosen.size()) - 1 : wedge_of[*entry];
    }
  }
  choose(wedges.normals, chosen);
  choose(wedges.uvs, chosen);
  if (chosen.size() > joined.first_of.size()) wedges.triangles = renumbered(triangles, wedge_of);
}

bool is_degenerate(const Eigen::Vector3i& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

void drop_degenerate_triangles(SkinnedMesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (is_degenerate(mesh.triangles[t])) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    if (!mesh.wedges.triangles.empty()) mesh.wedges.triangles[kept] = mesh.wedges.triangles[t];
    ++kept;
  }
  mesh.triangles.resize(kept);
  if (!mesh.wedges.triangles.empty()) mesh.wedges.triangles.resize(kept);
}

}  // namespace

void weld(SkinnedMesh& mesh) {
  const Joined joined = join_vertices(mesh);
  if (!mesh.wedges.normals.empty() || !mesh.wedges.uvs.empty()) join_wedges(joined, mesh.triangles, mesh.wedges);
  mesh.triangles = renumbered(std::move(mesh.triangles), joined.vertex_of);
  drop_degenerate_triangles(mesh);
}

}  // namespace layfigure::character
