#include "topology.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace layfigure::skinning {
namespace {

using character::Influence;
using Eigen::Vector3i;

/// Orders vertices by where and to what they are bound.
struct BindingOrder {
  const Skin& skin;

  bool operator()(int a, int b) const {
    const auto& p = skin.bind_positions()[a];
    const auto& q = skin.bind_positions()[b];
    if (p != q) return std::tuple(p.x(), p.y(), p.z()) < std::tuple(q.x(), q.y(), q.z());
    const auto in_order = [](const Influence& i, const Influence& j) {
      return std::tuple(i.bone, i.weight) < std::tuple(j.bone, j.weight);
    };
    const auto of_a = skin.influences(a);
    const auto of_b = skin.influences(b);
    return std::lexicographical_compare(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), in_order);
  }
};

/// Of each vertex the number of its point; there is no point without a vertex.
std::vector<int> points_of_vertices(const Skin& skin) {
  std::vector<int> order(skin.vertex_count());
  std::iota(order.begin(), order.end(), 0);
  const BindingOrder before{skin};
  std::stable_sort(order.begin(), order.end(), before);
  std::vector<int> points(order.size());
  int point = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && before(order[i - 1], order[i])) ++point;
    points[order[i]] = point;
  }
  return points;
}

/// An edge of one triangle.
struct TriangleEdge {
  int low, high;  ///< the points that it joins
  bool rises;     ///< runs from low to high
  int triangle;
  int corner;  ///< opposite to it

  [[nodiscard]] bool joins_the_same(const TriangleEdge& other) const { return low == other.low && high == other.high; }
};

std::vector<TriangleEdge> sorted_edges(const std::vector<Vector3i>& corners) {
  std::vector<TriangleEdge> edges;
  edges.reserve(3 * corners.size());
  for (int t = 0; t < static_cast<int>(corners.size()); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const int from = corners[t][(corner + 1) % 3];
      const int to = corners[t][(corner + 2) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), from < to, t, corner});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const TriangleEdge& a, const TriangleEdge& b) {
    return std::tuple(a.low, a.high, a.triangle, a.corner) < std::tuple(b.low, b.high, b.triangle, b.corner);
  });
  return edges;
}

/// Sets of points, each named by one of them.
class DisjointSets {
 public:
  explicit DisjointSets(int count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

  int find(int point) {
    while (parent_[point] != point) point = parent_[point] = parent_[parent_[point]];
    return point;
  }
  void unite(int a, int b) { parent_[find(a)] = find(b); }

 private:
  std::vector<int> parent_;
};

/// Fills `neighbours`; returns the triangles with an edge that has no neighbour.
std::vector<int> match_edges(Topology& topology) {
  std::vector<int> unmatched;
  const std::vector<TriangleEdge> edges = sorted_edges(topology.corners);
  for (auto begin = edges.begin(); begin != edges.end();) {
    const auto end =
        std::find_if(begin, edges.end(), [&](const TriangleEdge& edge) { return !edge.joins_the_same(*begin); });
    if (end - begin == 2 && begin[0].rises != begin[1].rises) {
      topology.neighbours[begin[0].triangle][begin[0].corner] = begin[1].triangle;
      topology.neighbours[begin[1].triangle][begin[1].corner] = begin[0].triangle;
    } else {
      for (auto edge = begin; edge != end; ++edge) unmatched.push_back(edge->triangle);
    }
    begin = end;
  }
  return unmatched;
}

void find_closed_parts(Topology& topology, const std::vector<int>& unmatched, int points) {
  DisjointSets parts(points);
  for (const Vector3i& corners : topology.corners) {
    parts.unite(corners[0], corners[1]);
    parts.unite(corners[1], corners[2]);
  }
  std::vector<bool> is_open(points, false);
  for (const int t : unmatched) is_open[parts.find(topology.corners[t][0])] = true;
  for (const Vector3i& corners : topology.corners) topology.closed.push_back(!is_open[parts.find(corners[0])]);
}

void collect_triangles_around(Topology& topology, int points) {
  topology.first_around.assign(points + 1, 0);
  for (const Vector3i& corners : topology.corners) {
    for (const int point : corners) ++topology.first_around[point + 1];
  }
  std::partial_sum(topology.first_around.begin(), topology.first_around.end(), topology.first_around.begin());
  std::vector<int> next(topology.first_around.begin(), topology.first_around.end() - 1);
  topology.triangles_around.resize(topology.first_around.back());
  for (int t = 0; t < static_cast<int>(topology.corners.size()); ++t) {
    for (const int point : topology.corners[t]) topology.triangles_around[next[point]++] = t;
  }
}

}  // namespace

Topology make_topology(const Skin& skin) {
  const std::vector<int> point_of = points_of_vertices(skin);
  const int points = point_of.empty() ? 0 : *std::max_element(point_of.begin(), point_of.end()) + 1;
  Topology topology;
  for (const Vector3i& t : skin.triangles()) {
    topology.corners.emplace_back(point_of[t[0]], point_of[t[1]], point_of[t[2]]);
  }
  topology.neighbours.assign(topology.corners.size(), Vector3i::Constant(-1));
  find_closed_parts(topology, match_edges(topology), points);
  collect_triangles_around(topology, points);
  return topology;
}

}  // namespace layfigure::skinning
