#include "shape_set.h"

#include <algorithm>
#include <limits>

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;

std::vector<std::pair<int, int>> sorted_pairs(std::vector<std::pair<int, int>> pairs) {
  for (auto& [a, b] : pairs) {
    if (a > b) std::swap(a, b);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

bool same(const ConvexHull& hull, const Pose& X_BS, const ShapeDefinition& known) {
  const auto* other = std::get_if<ConvexHull>(&known.shape);
  return other != nullptr && other->vertices == hull.vertices &&
         known.X_BS.rotation.coeffs() == X_BS.rotation.coeffs() && known.X_BS.position == X_BS.position;
}

}  // namespace

ShapeSet::ShapeSet(WorldDefinition definition, const ShapeSet* like) : definition_(std::move(definition)) {
  definition_.excluded = sorted_pairs(std::move(definition_.excluded));
  for (int i = 0; i < static_cast<int>(definition_.shapes.size()); ++i) {
    std::visit([&](const auto& shape) { add(shape, i, like); }, definition_.shapes[i].shape);
  }
}

void ShapeSet::add(const Sphere& shape, int index, const ShapeSet*) {
  add_core(make_polytope(shape, definition_.shapes[index].X_BS), index);
}

void ShapeSet::add(const Capsule& shape, int index, const ShapeSet*) {
  add_core(make_polytope(shape, definition_.shapes[index].X_BS), index);
}

void ShapeSet::add(const ConvexHull& shape, int index, const ShapeSet* like) {
  const Pose& X_BS = definition_.shapes[index].X_BS;
  const bool known = like != nullptr && index < static_cast<int>(like->definition_.shapes.size()) &&
                     same(shape, X_BS, like->definition_.shapes[index]);
  add_core(known ? *like->core_of(index) : make_polytope(shape, X_BS), index);
}

void ShapeSet::add(const Plane&, int index, const ShapeSet*) {
  const ShapeDefinition& shape = definition_.shapes[index];
  const Vector3d normal = shape.X_BS.rotation.normalized() * Vector3d::UnitZ();
  planes_.push_back({index, shape.body + 1, normal, normal.dot(shape.X_BS.position)});
}

void ShapeSet::add_core(Polytope core, int index) {
  ShrunkCore shrunk(core);
  cores_.push_back({index, definition_.shapes[index].body + 1, std::move(core), std::move(shrunk)});
}

const Polytope* ShapeSet::core_of(int index) const {
  return &std::ranges::find(cores_, index, &CoreShape::shape)->core;
}

bool ShapeSet::some_may_meet() const {
  const auto& shapes = definition_.shapes;
  return std::any_of(shapes.begin(), shapes.end(), [&](const ShapeDefinition& shape) {
    return shape.body != shapes.front().body && (shape.group == 0 || shape.group != shapes.front().group);
  });
}

bool ShapeSet::may_meet(int shape_a, int shape_b) const {
  const auto& a = definition_.shapes[shape_a];
  const auto& b = definition_.shapes[shape_b];
  if (a.body == b.body || (a.group != 0 && a.group == b.group)) return false;
  return !std::binary_search(definition_.excluded.begin(), definition_.excluded.end(),
                             std::pair<int, int>(std::minmax(a.body, b.body)));
}

std::vector<double> ShapeSet::radii() const {
  std::vector<double> radii(definition_.bodies + 1, 0.0);
  for (const CoreShape& shape : cores_) {
    for (const Vector3d& v : shape.core.vertices) {
      radii[shape.body] = std::max(radii[shape.body], v.norm() + shape.core.radius);
    }
  }
  for (const PlaneShape& plane : planes_) radii[plane.body] = std::numeric_limits<double>::infinity();
  return radii;
}

}  // namespace layfigure::collision
