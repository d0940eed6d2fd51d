#include "triangle_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <tuple>

namespace layfigure::skinning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Measured on a human: with 2 it takes longer to refit the boxes, with 8 to find the closest point of a near one.
constexpr int kLeafSize = 4;

/// The depth of a tree of as many triangles as an int can count.
constexpr int kMaxDepth = 32;

void grow(Vector3d& low, Vector3d& high, const Vector3d& other_low, const Vector3d& other_high) {
  low = low.cwiseMin(other_low);
  high = high.cwiseMax(other_high);
}

/// [m^2], 0 from within.
double squared_distance(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  const Vector3d nearest = p.cwiseMax(low).cwiseMin(high);
  return (p - nearest).squaredNorm();
}

}  // namespace

TriangleTree::TriangleTree(std::span<const Vector3i> triangles, std::span<const Vector3d> positions) {
  std::vector<Vector3d> centres;
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    const Vector3i& corners = triangles[t];
    triangles_.push_back({corners, t});
    centres.emplace_back((positions[corners[0]] + positions[corners[1]] + positions[corners[2]]) / 3.0);
  }
  if (!triangles_.empty()) build(0, static_cast<int>(triangles_.size()), centres);
  refit(positions);
}

/// Makes the node of triangles_[begin] to triangles_[end - 1] and all nodes below it, without their boxes.
int TriangleTree::build(int begin, int end, const std::vector<Vector3d>& centres) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.push_back({.low = Vector3d::Zero(), .high = Vector3d::Zero(), .first = begin, .count = end - begin});
  if (end - begin <= kLeafSize) return index;

  Vector3d low = Vector3d::Constant(kInfinity);
  Vector3d high = -low;
  for (int i = begin; i < end; ++i) grow(low, high, centres[triangles_[i].triangle], centres[triangles_[i].triangle]);
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(triangles_.begin() + begin, triangles_.begin() + middle, triangles_.begin() + end,
                   [&](const Leaf& a, const Leaf& b) {
                     return std::tuple(centres[a.triangle][axis], a.triangle) <
                            std::tuple(centres[b.triangle][axis], b.triangle);
                   });
  build(begin, middle, centres);
  nodes_[index].first = build(middle, end, centres);
  nodes_[index].count = 0;
  return index;
}

void TriangleTree::refit(std::span<const Vector3d> positions) {
  for (int index = static_cast<int>(nodes_.size()) - 1; index >= 0; --index) {
    Node& node = nodes_[index];
    if (node.count == 0) {
      node.low = nodes_[index + 1].low;
      node.high = nodes_[index + 1].high;
      grow(node.low, node.high, nodes_[node.first].low, nodes_[node.first].high);
      continue;
    }
    node.low = node.high = positions[triangles_[node.first].corners[0]];
    for (int i = node.first; i < node.first + node.count; ++i) {
      for (const int corner : triangles_[i].corners) grow(node.low, node.high, positions[corner], positions[corner]);
    }
  }
}

/// Calls visit(leaf) for the triangles of each leaf whose bound(node) is less than `limit`, which visit() lowers.
template <class Bound, class Visit>
void TriangleTree::descend(const Bound& bound, const Visit& visit, const double& limit) const {
  struct Branch {
    int node;
    double bound;
  };
  if (nodes_.empty()) return;
  std::array<Branch, kMaxDepth> later;
  int waiting = 0;
  later[waiting++] = {0, bound(nodes_[0])};
  while (waiting > 0) {
    Branch branch = later[--waiting];
    while (branch.bound < limit && nodes_[branch.node].count == 0) {
      Branch left{branch.node + 1, bound(nodes_[branch.node + 1])};
      Branch right{nodes_[branch.node].first, bound(nodes_[nodes_[branch.node].first])};
      if (right.bound < left.bound) std::swap(left, right);
      later[waiting++] = right;
      branch = left;
    }
    if (!(branch.bound < limit)) continue;
    const Node& leaf = nodes_[branch.node];
    for (int i = leaf.first; i < leaf.first + leaf.count; ++i) visit(triangles_[i]);
  }
}

std::optional<TriangleTree::Closest> TriangleTree::closest(std::span<const Vector3d> positions,
                                                           const Vector3d& p) const {
  Closest best;
  best.squared_distance = kInfinity;
  const auto bound = [&](const Node& node) { return squared_distance(p, node.low, node.high); };
  const auto visit = [&](const Leaf& leaf) {
    const TrianglePoint candidate =
        closest_on_triangle(p, positions[leaf.corners[0]], positions[leaf.corners[1]], positions[leaf.corners[2]]);
    const double distance = (candidate.point - p).squaredNorm();
    if (distance < best.squared_distance) best = {leaf.triangle, candidate, distance};
  };
  descend(bound, visit, best.squared_distance);
  return best.triangle < 0 ? std::nullopt : std::optional(best);
}

std::optional<TriangleTree::Hit> TriangleTree::cast(std::span<const Vector3d> positions, const Ray& ray) const {
  Hit best;
  best.crossing.distance = kInfinity;
  const auto bound = [&](const Node& node) { return ray.enter(node.low, node.high); };
  const auto visit = [&](const Leaf& leaf) {
    const auto crossing = ray.cross(positions[leaf.corners[0]], positions[leaf.corners[1]], positions[leaf.corners[2]]);
    if (crossing && crossing->distance < best.crossing.distance) best = {leaf.triangle, *crossing};
  };
  descend(bound, visit, best.crossing.distance);
  return best.triangle < 0 ? std::nullopt : std::optional(best);
}

}  // namespace layfigure::skinning
