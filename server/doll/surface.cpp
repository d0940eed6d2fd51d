#include "surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <set>

namespace layfigure::doll {
namespace {

using character::Influence;

void add_weight(std::vector<Influence>& list, int owner, double weight) {
  const auto same = std::find_if(list.begin(), list.end(), [&](const Influence& i) { return i.bone == owner; });
  if (same == list.end()) {
    list.push_back({owner, weight});
  } else {
    same->weight += weight;
  }
}

std::array<int, 3> sorted(const Eigen::Vector3i& triangle) {
  std::array<int, 3> corners{triangle[0], triangle[1], triangle[2]};
  std::sort(corners.begin(), corners.end());
  return corners;
}

}  // namespace

Surface make_surface(const character::Rig& rig) {
  Surface surface;
  std::map<std::array<double, 3>, int> known;
  std::set<std::array<int, 3>> seen;
  for (const character::SkinnedMesh& mesh : rig.meshes) {
    std::vector<int> joined(mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Eigen::Vector3d& point = mesh.vertices[v];
      const auto [entry, is_new] =
          known.try_emplace({point.x(), point.y(), point.z()}, static_cast<int>(surface.vertices.size()));
      joined[v] = entry->second;
      if (!is_new) continue;
      surface.vertices.push_back(point);
      surface.influences.push_back(mesh.influences[v]);
    }
    for (const auto& t : mesh.triangles) {
      const Eigen::Vector3i triangle(joined[t[0]], joined[t[1]], joined[t[2]]);
      const bool degenerate = triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
      if (degenerate || !seen.insert(sorted(triangle)).second) continue;
      surface.triangles.push_back(triangle);
    }
  }
  return surface;
}

void rename_owners(Surface& surface, const std::vector<int>& new_owner) {
  for (auto& influences : surface.influences) {
    std::vector<Influence> renamed;
    for (const Influence& i : influences) {
      if (new_owner[i.bone] >= 0) add_weight(renamed, new_owner[i.bone], i.weight);
    }
    influences = std::move(renamed);
  }
}

std::vector<int> triangle_owners(const Surface& surface) {
  std::vector<int> owners;
  owners.reserve(surface.triangles.size());
  for (const auto& triangle : surface.triangles) {
    std::vector<Influence> sums;
    for (const int corner : triangle) {
      for (const Influence& i : surface.influences[corner]) add_weight(sums, i.bone, i.weight);
    }
    const auto heaviest = std::max_element(sums.begin(), sums.end(), [](const Influence& a, const Influence& b) {
      return a.weight != b.weight ? a.weight < b.weight : a.bone > b.bone;
    });
    owners.push_back(heaviest == sums.end() ? -1 : heaviest->bone);
  }
  return owners;
}

double weight_of(const Surface& surface, int vertex, int owner) {
  for (const Influence& i : surface.influences[vertex]) {
    if (i.bone == owner) return i.weight;
  }
  return 0.0;
}

double triangle_area(const Surface& surface, const Eigen::Vector3i& triangle) {
  const Eigen::Vector3d& a = surface.vertices[triangle[0]];
  return 0.5 * (surface.vertices[triangle[1]] - a).cross(surface.vertices[triangle[2]] - a).norm();
}

}  // namespace layfigure::doll
