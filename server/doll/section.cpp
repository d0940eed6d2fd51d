#include "section.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <set>

namespace layfigure::doll {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Where a limb weighs less than this, the skin is the trunk's.
constexpr double kLeastShare = 0.1;

/// Of the largest loop's area: smaller ones are folds of the skin.
constexpr double kSliver = 0.05;

using Polygon = std::vector<Vector2d>;
using Edge = std::pair<int, int>;  // of the mesh, lower vertex first

/// Cuts triangles into segments that are joined by the mesh's edges, not by distance: no tolerance is needed.
class Cutter {
 public:
  Cutter(const Surface& surface, const Cut& cut) : surface_(surface), cut_(cut) {
    // Any two axes in the plane; u x v = normal.
    u_ = cut.normal.unitOrthogonal();
    v_ = cut.normal.cross(u_);
    for (const auto& triangle : surface.triangles) add(triangle);
  }

  /// Closed loops, and open chains to be closed by their chord.
  [[nodiscard]] std::vector<Polygon> polygons() {
    std::vector<Edge> chain_starts;
    for (const auto& [from, to] : next_) {
      if (!arrived_.contains(from)) chain_starts.push_back(from);
    }
    std::vector<Polygon> result;
    for (const Edge& start : chain_starts) result.push_back(follow(start));
    while (!next_.empty()) result.push_back(follow(next_.begin()->first));
    return result;
  }

 private:
  [[nodiscard]] double height(int vertex) const { return cut_.normal.dot(surface_.vertices[vertex] - cut_.point); }

  [[nodiscard]] double share(int vertex) const {
    const double own = weight_of(surface_, vertex, cut_.owner);
    return cut_.other < 0 ? own : own + weight_of(surface_, vertex, cut_.other);
  }

  /// Fraction along the edge at which it crosses the plane.
  [[nodiscard]] double crossing(const Edge& edge) const {
    const double a = height(edge.first);
    return a / (a - height(edge.second));
  }

  [[nodiscard]] double share_at(const Edge& edge) const {
    const double f = crossing(edge);
    return (1.0 - f) * share(edge.first) + f * share(edge.second);
  }

  [[nodiscard]] Vector2d point_at(const Edge& edge) const {
    const double f = crossing(edge);
    const Vector3d p = (1.0 - f) * surface_.vertices[edge.first] + f * surface_.vertices[edge.second] - cut_.point;
    return {u_.dot(p), v_.dot(p)};
  }

  /// A vertex on the plane counts as above it, so that each triangle has no or exactly two crossed edges.
  void add(const Eigen::Vector3i& triangle) {
    std::array<Edge, 2> crossed;  // where the plane's line enters and leaves
    bool cuts = false;
    for (int k = 0; k < 3; ++k) {
      const int a = triangle[k];
      const int b = triangle[(k + 1) % 3];
      const bool a_above = height(a) >= 0.0;
      if (a_above == (height(b) >= 0.0)) continue;
      crossed[a_above ? 0 : 1] = std::minmax(a, b);
      cuts = true;
    }
    if (!cuts || share_at(crossed[0]) + share_at(crossed[1]) < 2.0 * kLeastShare) return;
    next_.emplace(crossed[0], crossed[1]);
    arrived_.insert(crossed[1]);
  }

  Polygon follow(Edge edge) {
    Polygon polygon{point_at(edge)};
    for (auto at = next_.find(edge); at != next_.end(); at = next_.find(edge)) {
      edge = at->second;
      next_.erase(at);
      polygon.push_back(point_at(edge));
    }
    return polygon;
  }

  const Surface& surface_;
  const Cut& cut_;
  Vector3d u_;
  Vector3d v_;
  std::map<Edge, Edge> next_;
  std::set<Edge> arrived_;
};

/// Whether the origin is inside, by the number of crossings of the positive x axis.
bool contains_origin(const Polygon& polygon) {
  bool inside = false;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector2d& a = polygon[k];
    const Vector2d& b = polygon[(k + 1) % polygon.size()];
    if ((a.y() > 0.0) == (b.y() > 0.0)) continue;
    if (a.x() + (b.x() - a.x()) * a.y() / (a.y() - b.y()) > 0.0) inside = !inside;
  }
  return inside;
}

}  // namespace

PlaneFigure plane_figure(const std::vector<Vector2d>& polygon) {
  if (polygon.size() < 3) return {};
  double twice_area = 0.0;
  Vector2d first = Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  const Vector2d reference = polygon.front();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector2d a = polygon[k] - reference;
    const Vector2d b = polygon[(k + 1) % polygon.size()] - reference;
    const double d = a.x() * b.y() - b.x() * a.y();
    const Vector2d s = a + b;
    twice_area += d;
    first += d / 6.0 * s;
    second += d / 24.0 * (a * a.transpose() + b * b.transpose() + s * s.transpose());
  }
  if (twice_area == 0.0) return {};
  PlaneFigure figure;
  const double sign = twice_area > 0.0 ? 1.0 : -1.0;
  const Vector2d centroid = first / (0.5 * twice_area);
  figure.area = 0.5 * std::abs(twice_area);
  figure.centroid = reference + centroid;
  figure.second_moment = sign * second - figure.area * centroid * centroid.transpose();
  for (const Vector2d& p : polygon) figure.outermost = std::max(figure.outermost, (p - figure.centroid).norm());
  return figure;
}

std::optional<PlaneFigure> cut_surface(const Surface& surface, const Cut& cut) {
  struct Loop {
    PlaneFigure figure;
    bool about_point;
  };
  std::vector<Loop> loops;
  double largest = 0.0;
  for (const Polygon& polygon : Cutter(surface, cut).polygons()) {
    loops.push_back({plane_figure(polygon), contains_origin(polygon)});
    largest = std::max(largest, loops.back().figure.area);
  }
  std::erase_if(loops, [&](const Loop& loop) { return !(loop.figure.area > kSliver * largest); });
  if (loops.empty()) return std::nullopt;
  const auto better = [](const Loop& a, const Loop& b) {
    if (a.about_point != b.about_point) return a.about_point;
    if (a.about_point) return a.figure.area > b.figure.area;
    return a.figure.centroid.norm() < b.figure.centroid.norm();
  };
  return std::min_element(loops.begin(), loops.end(), better)->figure;
}

}  // namespace layfigure::doll
