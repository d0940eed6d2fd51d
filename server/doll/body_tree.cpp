#include "body_tree.h"

#include <stdexcept>

namespace layfigure::doll {
namespace {

using character::Bone;

constexpr int kLeastTriangles = 4;        // of a closed solid
constexpr double kLeastAreaShare = 1e-4;  // a fingertip of an adult has 5e-4

std::vector<double> skin_areas(const Surface& surface, const std::vector<int>& owners, std::vector<int>& triangles) {
  std::vector<double> areas(triangles.size(), 0.0);
  for (std::size_t t = 0; t < owners.size(); ++t) {
    if (owners[t] < 0) continue;
    areas[owners[t]] += triangle_area(surface, surface.triangles[t]);
    ++triangles[owners[t]];
  }
  return areas;
}

std::vector<bool> bones_with_skin(const Surface& surface, const std::vector<double>& areas,
                                  const std::vector<int>& triangles) {
  double total = 0.0;
  for (const auto& triangle : surface.triangles) total += triangle_area(surface, triangle);
  std::vector<bool> enough(areas.size());
  for (std::size_t b = 0; b < areas.size(); ++b) {
    enough[b] = triangles[b] >= kLeastTriangles && areas[b] > 0.0 && areas[b] >= kLeastAreaShare * total;
  }
  return enough;
}

/// The bone whose body carries each bone; -1: none.
std::vector<int> carrier_bones(const std::vector<Bone>& bones, const std::vector<bool>& enough,
                               const std::vector<double>& areas) {
  const int count = static_cast<int>(bones.size());
  std::vector<int> carrier(count, -1);
  std::vector<int> root(count);
  std::vector<int> root_carrier(count, -1);
  for (int b = 0; b < count; ++b) {
    const int parent = bones[b].parent;
    root[b] = parent < 0 ? b : root[parent];
    const int inherited = parent < 0 ? -1 : carrier[parent];
    carrier[b] = enough[b] ? b : inherited;
    int& best = root_carrier[root[b]];
    if (enough[b] && inherited < 0 && (best < 0 || areas[b] > areas[best])) best = b;
  }
  for (int b = 0; b < count; ++b) {
    if (carrier[b] < 0) carrier[b] = root_carrier[root[b]];
  }
  return carrier;
}

/// Adds the body of `bone` and all that hang on it, depth first.
void add_bodies(int root_bone, const std::vector<std::vector<int>>& children, BodyTree& tree,
                std::vector<int>& body_of_bone) {
  std::vector<std::pair<int, int>> pending{{root_bone, -1}};
  while (!pending.empty()) {
    const auto [bone, parent] = pending.back();
    pending.pop_back();
    const int body = static_cast<int>(tree.bone_of_body.size());
    body_of_bone[bone] = body;
    tree.bone_of_body.push_back(bone);
    tree.parent_of_body.push_back(parent);
    for (auto child = children[bone].rbegin(); child != children[bone].rend(); ++child) {
      pending.emplace_back(*child, body);
    }
  }
}

}  // namespace

BodyTree make_body_tree(const std::vector<Bone>& bones, const Surface& surface, const std::vector<int>& owners) {
  std::vector<int> triangles(bones.size(), 0);
  const std::vector<double> areas = skin_areas(surface, owners, triangles);
  const std::vector<bool> enough = bones_with_skin(surface, areas, triangles);
  const std::vector<int> carrier = carrier_bones(bones, enough, areas);

  std::vector<std::vector<int>> children(bones.size());
  std::vector<int> roots;
  for (int b = 0; b < static_cast<int>(bones.size()); ++b) {
    if (!enough[b]) continue;
    const int above = bones[b].parent < 0 ? b : carrier[bones[b].parent];
    if (above == b) {
      roots.push_back(b);
    } else {
      children[above].push_back(b);
    }
  }
  if (roots.empty()) throw std::invalid_argument("no bone has enough skin to be a body; check the mesh's weights");

  BodyTree tree;
  std::vector<int> body_of_bone(bones.size(), -1);
  for (const int root : roots) add_bodies(root, children, tree, body_of_bone);
  for (const int bone : carrier) tree.carrier_of_bone.push_back(bone < 0 ? -1 : body_of_bone[bone]);
  return tree;
}

}  // namespace layfigure::doll
