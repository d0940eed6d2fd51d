#include "polytope.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

// Vertices this near to a plane, relative to the hull's size, lie in it: far above the rounding of a rotated vertex
// (1e-16), far below what shows in a contact (1e-9 m for a limb).
constexpr double kCoplanar = 1e-8;

// Vertices nearer than this to each other, relative to the hull's size, are one, and triangles flatter than it are
// lines.
constexpr double kCoincident = 1e-6;

Points placed(const Points& points, const Pose& X_BS) {
  Points result;
  for (const auto& p : points) result.push_back(X_BS.rotation * p + X_BS.position);
  return result;
}

Points without_repeats(const Points& points, double distance) {
  Points result;
  for (const auto& p : points) {
    const auto near = [&](const Vector3d& other) { return (p - other).norm() <= distance; };
    if (std::none_of(result.begin(), result.end(), near)) result.push_back(p);
  }
  return result;
}

void add_bounds(Polytope& core) {
  Vector3d low = core.vertices.front(), high = low, sum = Vector3d::Zero();
  for (const auto& v : core.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
    sum += v;
  }
  core.center = sum / static_cast<double>(core.vertices.size());
  core.box_center = 0.5 * (low + high);
  core.box_half = 0.5 * (high - low) + Vector3d::Constant(core.radius);
  for (const auto& v : core.vertices) core.size = std::max(core.size, (v - core.center).norm());
}

Polytope segment(const Vector3d& a, const Vector3d& b, double radius) {
  Polytope core;
  core.radius = radius;
  core.vertices = {a};
  if (a != b) core.vertices.push_back(b);
  core.edges = {{0, static_cast<int>(core.vertices.size()) - 1}};
  core.vertex_faces.resize(core.vertices.size());
  add_bounds(core);
  return core;
}

Vector3d farthest_from(const Points& points, const Vector3d& origin) {
  return *std::max_element(points.begin(), points.end(), [&](const Vector3d& p, const Vector3d& q) {
    return (p - origin).squaredNorm() < (q - origin).squaredNorm();
  });
}

/// The corners of the convex hull of coplanar vertices, counterclockwise about the normal (gift wrapping: the next
/// corner is the one that leaves all others on its left; of several in line, the farthest).
std::vector<int> outline(const Points& points, const std::vector<int>& members, const Vector3d& normal, double slack) {
  const auto first = *std::min_element(members.begin(), members.end(), [&](int i, int j) {
    return std::lexicographical_compare(points[i].data(), points[i].data() + 3, points[j].data(), points[j].data() + 3);
  });
  std::vector<int> loop{first};
  while (loop.size() <= members.size()) {
    const Vector3d& from = points[loop.back()];
    int next = loop.back();
    for (const int candidate : members) {
      const Vector3d to = points[candidate] - from, best = points[next] - from;
      const double turn = normal.dot(best.cross(to)), reach = to.squaredNorm(), scale = slack * best.norm();
      const bool outside = turn < -scale || (turn <= scale && reach > best.squaredNorm());
      if (reach > slack * slack && (best.squaredNorm() == 0.0 || outside)) next = candidate;
    }
    if (next == first || next == loop.back()) break;
    loop.push_back(next);
  }
  return loop;
}

bool contains_all(const std::vector<int>& members, int i, int j, int k) {
  const auto has = [&](int v) { return std::binary_search(members.begin(), members.end(), v); };
  return has(i) && has(j) && has(k);
}

/// The vertices in the plane, in ascending order; none at all if a vertex lies outside it.
std::vector<int> supported(const Points& points, const Vector3d& normal, double offset, double slack) {
  std::vector<int> members;
  for (int v = 0; v < static_cast<int>(points.size()); ++v) {
    const double height = normal.dot(points[v]) - offset;
    if (height > slack) return {};
    if (height >= -slack) members.push_back(v);
  }
  return members;
}

/// Collects a hull's faces: every plane through three vertices that has all others on one side.
class FaceFinder {
 public:
  FaceFinder(const Points& points, double size)
      : points_(points), slack_(kCoplanar * size), flat_(kCoincident * size) {}

  std::vector<Face> find() {
    const int n = static_cast<int>(points_.size());
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        for (int k = j + 1; k < n; ++k) try_plane(i, j, k);
      }
    }
    return std::move(faces_);
  }

 private:
  void try_plane(int i, int j, int k) {
    const Vector3d u = points_[j] - points_[i], v = points_[k] - points_[i];
    const Vector3d cross = u.cross(v);
    const double area = cross.norm();
    if (area <= flat_ * std::max({u.norm(), v.norm(), (u - v).norm()})) return;
    for (const double side : {1.0, -1.0}) add_face(side / area * cross, i, j, k);
  }

  void add_face(const Vector3d& normal, int i, int j, int k) {
    const std::vector<int> members = supported(points_, normal, normal.dot(points_[i]), slack_);
    if (members.empty()) return;
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      if (normal.dot(faces_[f].normal) > 0.0 && contains_all(members_[f], i, j, k)) return;
    }
    double offset = normal.dot(points_[i]);
    for (const int v : members) offset = std::max(offset, normal.dot(points_[v]));
    faces_.push_back({normal, offset, outline(points_, members, normal, slack_)});
    members_.push_back(members);
  }

  const Points& points_;
  double slack_;
  double flat_;
  std::vector<Face> faces_;
  std::vector<std::vector<int>> members_;
};

/// Keeps the vertices that some face uses, and renumbers the faces.
void keep_used_vertices(const Points& points, Polytope& core) {
  std::vector<int> index(points.size(), -1);
  for (auto& face : core.faces) {
    for (int& v : face.loop) {
      if (index[v] < 0) {
        index[v] = static_cast<int>(core.vertices.size());
        core.vertices.push_back(points[v]);
      }
      v = index[v];
    }
  }
}

void add_topology(Polytope& core) {
  std::set<std::pair<int, int>> edges;
  core.vertex_faces.resize(core.vertices.size());
  for (int f = 0; f < static_cast<int>(core.faces.size()); ++f) {
    const auto& loop = core.faces[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      edges.insert(std::minmax({loop[k], loop[(k + 1) % loop.size()]}));
      core.vertex_faces[loop[k]].push_back(f);
    }
  }
  core.edges.assign(edges.begin(), edges.end());
}

}  // namespace

Polytope make_polytope(const Sphere& sphere, const Pose& X_BS) {
  return segment(X_BS.position, X_BS.position, sphere.radius);
}

Polytope make_polytope(const Capsule& capsule, const Pose& X_BS) {
  const Vector3d half = X_BS.rotation * Vector3d(0.0, 0.0, capsule.half_length);
  return segment(X_BS.position - half, X_BS.position + half, capsule.radius);
}

Polytope make_polytope(const ConvexHull& hull, const Pose& X_BS) {
  const Points given = placed(hull.vertices, X_BS);
  const Vector3d a = farthest_from(given, given.front());
  const Vector3d b = farthest_from(given, a);
  const double size = (b - a).norm();
  const Points points = without_repeats(given, kCoincident * size);
  Polytope core;
  core.faces = FaceFinder(points, size).find();
  // Without any face the points lie on a line, and a and b are its ends.
  if (core.faces.empty()) return segment(a, b, 0.0);
  keep_used_vertices(points, core);
  add_topology(core);
  add_bounds(core);
  return core;
}

}  // namespace layfigure::collision
