#include "section.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

namespace layfigure::doll {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Where a limb weighs less than this, the skin is the trunk's.
constexpr double kLeastShare = 0.1;

/// Of the largest loop's area: smaller outlines are folds of the skin, and smaller holes change nothing that counts.
constexpr double kSliver = 0.05;
constexpr double kPore = 1e-3;

/// A rim in more pieces than this is a soup of triangles, which no chord can mend.
constexpr std::size_t kMostPieces = 256;

/// An axis this much nearer to the normal than an earlier one counts as nearer: a bone midway between two of its axes
/// is not to hang on rounding.
constexpr double kNearer = 1.1;

using Edge = std::pair<int, int>;  // of the mesh, lower vertex first

/// Cuts triangles into segments that are joined by the mesh's edges, not by distance: no tolerance is needed.
class Cutter {
 public:
  Cutter(const Surface& surface, const Cut& cut) : surface_(surface), cut_(cut) {
    for (const auto& triangle : surface.triangles) add(triangle);
  }

  /// The chains that begin where none ends, which takes them out.
  [[nodiscard]] std::vector<Polygon> take_chains() {
    std::vector<Polygon> chains;
    for (const auto& [edge, surplus] : surplus_) {
      for (int k = 0; k < surplus; ++k) chains.push_back(follow(edge));
    }
    return chains;
  }

  /// What is closed of what is left.
  [[nodiscard]] std::vector<Polygon> take_loops() {
    std::vector<Polygon> loops;
    while (!next_.empty()) loops.push_back(follow(next_.begin()->first));
    return loops;
  }

 private:
  [[nodiscard]] double height(int vertex) const { return cut_.axes.col(0).dot(surface_.vertices[vertex] - cut_.point); }

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
    return {cut_.axes.col(1).dot(p), cut_.axes.col(2).dot(p)};
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
    ++surplus_[crossed[0]];
    --surplus_[crossed[1]];
  }

  /// Takes out the segments from `edge` on until none goes on.
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
  std::multimap<Edge, Edge> next_;  // several leave an edge of more than two triangles
  std::map<Edge, int> surplus_;     // segments that leave less those that arrive
};

/// For each chain the one that goes on from its end, itself at the last: the shortest gaps first.
std::vector<std::size_t> successors(const std::vector<Polygon>& chains) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> gaps;
  for (std::size_t from = 0; from < chains.size(); ++from) {
    for (std::size_t to = 0; to < chains.size(); ++to) {
      gaps.emplace_back((chains[to].front() - chains[from].back()).norm(), from, to);
    }
  }
  std::sort(gaps.begin(), gaps.end());
  std::vector<std::size_t> next(chains.size(), chains.size());
  std::vector<bool> arrived(chains.size(), false);
  for (const auto& [gap, from, to] : gaps) {
    if (next[from] < chains.size() || arrived[to]) continue;
    next[from] = to;
    arrived[to] = true;
  }
  return next;
}

std::vector<Polygon> close_chains(std::vector<Polygon> chains) {
  if (chains.size() > kMostPieces) return chains;  // each by its own chord
  const std::vector<std::size_t> next = successors(chains);
  std::vector<Polygon> polygons;
  std::vector<bool> taken(chains.size(), false);
  for (std::size_t first = 0; first < chains.size(); ++first) {
    if (taken[first]) continue;
    polygons.emplace_back();
    for (std::size_t k = first; !taken[k]; k = next[k]) {
      taken[k] = true;
      polygons.back().insert(polygons.back().end(), chains[k].begin(), chains[k].end());
    }
  }
  return polygons;
}

struct Loop {
  Polygon polygon;
  double area;  // positive if it runs counter-clockwise

  [[nodiscard]] double size() const { return std::abs(area); }
  [[nodiscard]] bool surrounds(const Loop& other) const {
    return size() > other.size() && contains(polygon, other.polygon.front());
  }
};

/// All loops of the cut but the pores.
std::vector<Loop> find_loops(const Surface& surface, const Cut& cut) {
  Cutter cutter(surface, cut);
  std::vector<Polygon> polygons = close_chains(cutter.take_chains());
  for (Polygon& polygon : cutter.take_loops()) polygons.push_back(std::move(polygon));
  std::vector<Loop> loops;
  double largest = 0.0;
  for (Polygon& polygon : polygons) {
    const double area = 0.5 * twice_signed_area(polygon);
    largest = std::max(largest, std::abs(area));
    loops.push_back({std::move(polygon), area});
  }
  std::erase_if(loops, [&](const Loop& loop) { return !(loop.size() > kPore * largest); });
  return loops;
}

bool is_within_another(const Loop& loop, const std::vector<Loop>& loops) {
  return std::any_of(loops.begin(), loops.end(), [&](const Loop& other) { return other.surrounds(loop); });
}

/// The loop of the limb about the origin; nullptr: there is none.
const Loop* limb_outline(const std::vector<Loop>& loops) {
  struct Candidate {
    const Loop* loop;
    bool about_point;
    double distance;
  };
  double largest = 0.0;
  for (const Loop& loop : loops) largest = std::max(largest, loop.size());
  std::vector<Candidate> candidates;
  for (const Loop& loop : loops) {
    if (loop.size() < kSliver * largest || is_within_another(loop, loops)) continue;
    const double distance = plane_figure({loop.polygon}).centroid.norm();
    candidates.push_back({&loop, contains(loop.polygon, Vector2d::Zero()), distance});
  }
  const auto better = [](const Candidate& a, const Candidate& b) {
    if (a.about_point != b.about_point) return a.about_point;
    return a.about_point ? a.loop->size() > b.loop->size() : a.distance < b.distance;
  };
  const auto best = std::min_element(candidates.begin(), candidates.end(), better);
  return best == candidates.end() ? nullptr : best->loop;
}

/// Whether the material of `outline` ends or begins again at `loop`, which is within: whether the nearest loop around
/// it runs the other way.
bool bounds_material(const Loop& loop, const Loop& outline, const std::vector<Loop>& loops) {
  if (!outline.surrounds(loop)) return false;
  const Loop* nearest = &outline;
  for (const Loop& other : loops) {
    if (nearest->size() > other.size() && outline.surrounds(other) && other.surrounds(loop)) nearest = &other;
  }
  return (nearest->area > 0.0) != (loop.area > 0.0);
}

}  // namespace

Matrix3d cut_axes(const Vector3d& normal, const Matrix3d& bone) {
  const Vector3d nearness = (bone.transpose() * normal).cwiseAbs();
  int along = 0;
  for (int k = 1; k < 3; ++k) {
    if (nearness[k] > kNearer * nearness[along]) along = k;
  }
  const Vector3d reference = bone.col((along + 1) % 3);
  Matrix3d axes;
  axes.col(0) = normal;
  axes.col(1) = (reference - normal.dot(reference) * normal).normalized();
  axes.col(2) = normal.cross(axes.col(1));
  return axes;
}

std::optional<PlaneFigure> cut_surface(const Surface& surface, const Cut& cut) {
  const std::vector<Loop> loops = find_loops(surface, cut);
  const Loop* outline = limb_outline(loops);
  if (outline == nullptr) return std::nullopt;
  std::vector<Polygon> polygons{outline->polygon};
  for (const Loop& loop : loops) {
    if (bounds_material(loop, *outline, loops)) polygons.push_back(loop.polygon);
  }
  PlaneFigure figure = plane_figure(polygons);
  if (figure.area > 0.0) return figure;
  return std::nullopt;
}

Section principal_section(const PlaneFigure& figure, const Eigen::Isometry3d& X_BC) {
  const Vector2d y = major_axis(figure);
  const Vector2d z(-y.y(), y.x());
  Matrix3d R_CS = Matrix3d::Identity();
  R_CS.block<2, 1>(1, 1) = y;
  R_CS.block<2, 1>(1, 2) = z;
  Section section;
  section.axes = Eigen::Quaterniond(X_BC.linear() * R_CS).normalized();
  section.area = figure.area;
  const double about_y = z.dot(figure.second_moment * z);
  const double about_z = y.dot(figure.second_moment * y);
  section.second_moments = {about_y + about_z, about_y, about_z};
  section.outermost = {figure.outermost(), figure.outermost(z), figure.outermost(y)};
  for (const Vector2d& p : figure.outline) section.outline.emplace_back(X_BC * Vector3d(0.0, p.x(), p.y()));
  return section;
}

Section round_section(double area, const Matrix3d& axes) {
  const double moment = area * area / (4.0 * std::numbers::pi);
  Section section;
  section.axes = Eigen::Quaterniond(axes).normalized();
  section.area = area;
  section.second_moments = {2.0 * moment, moment, moment};
  section.outermost.setConstant(std::sqrt(area / std::numbers::pi));
  section.estimated = true;
  return section;
}

}  // namespace layfigure::doll
