#include "separation.h"

#include <algorithm>
#include <cmath>

namespace layfigure::collision {
namespace {

using Cores = std::array<PlacedCore, 2>;
using Edge = std::pair<int, int>;
using Eigen::Vector3d;

// A capsule against any limb's hull, two boxes: below this, trying all pairs of edges costs less than a search.
constexpr std::size_t kAllPairs = 200;

// Vertices so near to a core's extreme one, relative to its size, may belong to the closest edge: covers the search's
// error and what its shrunk cores displace.
constexpr double kSlack = 0.02;

// Directions are improved this often; each time the edges about the last one are tried.
constexpr int kRounds = 8;

// A distance proves a separation that is less than this below it, relative to the size and the distance: rounding of
// 1e-16, amplified where a small distance gives the direction.
constexpr double kProof = 1e-10;

// Edges with a sine below this have no usable common normal.
constexpr double kParallel = 1e-7;

double size_of(const Cores& cores) { return cores[0].core->size + cores[1].core->size; }

double proof_tolerance(const Cores& cores, double distance) { return kProof * (size_of(cores) + distance); }

Segment segment_of(const PlacedCore& core, const Edge& edge) {
  return {core.vertices[edge.first], core.vertices[edge.second]};
}

/// A point in the frame of the body that carries the core.
Vector3d in_own_frame(const PlacedCore& core, const Vector3d& p) { return core.R.transpose() * (p - core.p); }

/// Of a point in the core's own frame.
double height_over(const Face& face, const Vector3d& p) { return face.normal.dot(p) - face.offset; }

/// The edges with a vertex near the core's extreme one along `outward`.
void gather_edges(const PlacedCore& core, const Vector3d& outward, double slack, std::vector<Edge>& edges) {
  edges.clear();
  double extreme = -std::numeric_limits<double>::infinity();
  for (const auto& v : core.vertices) extreme = std::max(extreme, outward.dot(v));
  const auto near = [&](int v) { return outward.dot(core.vertices[v]) >= extreme - slack; };
  for (const auto& edge : core.core->edges) {
    if (near(edge.first) || near(edge.second)) edges.push_back(edge);
  }
}

/// The gathered edges whose closest points are closest, and the normal between those; the separation is left open.
EdgeSeparation closest_edges(const NarrowScratch& scratch) {
  EdgeSeparation best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& edge_a : scratch.edges[0]) {
    const Segment a = segment_of(scratch.cores[0], edge_a);
    for (const auto& edge_b : scratch.edges[1]) {
      const ClosestPoints points = closest_points(a, segment_of(scratch.cores[1], edge_b));
      const Vector3d apart = points.a - points.b;
      if (apart.squaredNorm() >= least) continue;
      least = apart.squaredNorm();
      best.normal = apart;
      best.edges = {edge_a, edge_b};
    }
  }
  best.distance = std::sqrt(least);
  if (best.distance > 0.0) best.normal /= best.distance;
  return best;
}

/// Raises `best` to the separation along n where that is larger and the edges, which are `bound` apart, are those that
/// support the cores there.
void try_crossing(const NarrowScratch& scratch, const Vector3d& n, double bound, const EdgePair& edges,
                  EdgeSeparation& best) {
  if (bound <= best.separation) return;
  const double separation = separation_along(scratch.cores, n);
  const bool supports = separation >= bound - kProof * size_of(scratch.cores);
  if (supports && separation > best.separation) best = {.separation = separation, .normal = n, .edges = edges};
}

/// The largest separation along the common normals of two gathered edges: either way where all were gathered, else
/// along `direction`.
EdgeSeparation deepest_crossing(const NarrowScratch& scratch, const Vector3d& direction) {
  const bool all = tries_all_edges(scratch.cores);
  EdgeSeparation best;
  for (const auto& edge_a : scratch.edges[0]) {
    const Segment a = segment_of(scratch.cores[0], edge_a);
    const Vector3d u = a.end - a.start;
    for (const auto& edge_b : scratch.edges[1]) {
      const Segment b = segment_of(scratch.cores[1], edge_b);
      const Vector3d v = b.end - b.start;
      Vector3d n = u.cross(v);
      const double length = n.norm();
      if (length <= kParallel * u.norm() * v.norm()) continue;
      n /= n.dot(direction) < 0.0 ? -length : length;
      const double bound = n.dot(a.start - b.start);
      try_crossing(scratch, n, bound, {edge_a, edge_b}, best);
      if (all) try_crossing(scratch, -n, -bound, {edge_a, edge_b}, best);
    }
  }
  return best;
}

/// Of cores that touch where no two edges cross, such as spheres about one point: a normal square to their edges.
/// Faces, where there are any, part the cores better.
EdgeSeparation touching(const NarrowScratch& scratch) {
  EdgeSeparation result = closest_edges(scratch);
  Vector3d along = Vector3d::UnitX();
  for (const int side : {0, 1}) {
    const Segment edge = segment_of(scratch.cores[side], result.edges[side]);
    if (edge.end != edge.start) along = edge.end - edge.start;
  }
  result.normal = along.unitOrthogonal();
  result.separation = separation_along(scratch.cores, result.normal);
  return result;
}

void gather_both(NarrowScratch& scratch, const Vector3d& direction) {
  const bool all = tries_all_edges(scratch.cores);
  for (const int side : {0, 1}) {
    const PlacedCore& core = scratch.cores[side];
    const double slack = all ? std::numeric_limits<double>::infinity() : kSlack * core.core->size;
    gather_edges(core, side == 0 ? -direction : direction, slack, scratch.edges[side]);
  }
}

}  // namespace

double smaller_size(const Cores& cores) {
  const auto size = [](const Polytope& core) { return core.size + core.radius; };
  return std::min(size(*cores[0].core), size(*cores[1].core));
}

double separation_along(const Cores& cores, const Vector3d& n) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& v : cores[0].vertices) low = std::min(low, n.dot(v));
  for (const auto& v : cores[1].vertices) high = std::max(high, n.dot(v));
  return low - high;
}

double unplaced_separation_along(const Cores& cores, const Vector3d& n) {
  double sum = 0.0;
  for (const int side : {0, 1}) {
    const PlacedCore& placed = cores[side];
    const Vector3d direction = placed.R.transpose() * (side == 0 ? n : Vector3d(-n));  // in the core's own frame
    double least = std::numeric_limits<double>::infinity();
    for (const auto& v : placed.core->vertices) least = std::min(least, direction.dot(v));
    sum += least + (side == 0 ? n : Vector3d(-n)).dot(placed.p);
  }
  return sum;
}

FaceSeparation separation_of(const Cores& cores, int side, int face) {
  const PlacedCore& own = cores[side];
  const PlacedCore& other = cores[1 - side];
  const Vector3d n = own.normal(face);
  const double offset = own.core->faces[face].offset + n.dot(own.p);
  int support = 0;
  double lowest = std::numeric_limits<double>::infinity();
  for (int v = 0; v < static_cast<int>(other.vertices.size()); ++v) {
    const double height = n.dot(other.vertices[v]);
    if (height < lowest) {
      lowest = height;
      support = v;
    }
  }
  return {{side, face, -1}, lowest - offset, support};
}

FaceSeparation largest_face_separation(const Cores& cores, const FaceSeparation& preferred, double reach) {
  FaceSeparation best = preferred;
  const double hysteresis = kFaceHysteresis * smaller_size(cores);
  for (const int side : {0, 1}) {
    const PlacedCore& own = cores[side];
    const PlacedCore& other = cores[1 - side];
    // The other core is no higher above any face than one of its points.
    Vector3d low = in_own_frame(own, preferred.face.side == side ? other.vertices[preferred.support] : other.center());
    for (int face = 0; face < static_cast<int>(own.core->faces.size()); ++face) {
      if (best.separation > reach) return best;
      const bool keeps = best.face.side >= 0 && best.face == preferred.face;
      const double least = best.separation + (keeps ? hysteresis : 0.0);
      if (height_over(own.core->faces[face], low) <= least) continue;
      const FaceSeparation found = separation_of(cores, side, face);
      low = in_own_frame(own, other.vertices[found.support]);
      if (found.separation > least) best = found;
    }
  }
  return best;
}

bool tries_all_edges(const Cores& cores) {
  return cores[0].core->edges.size() * cores[1].core->edges.size() <= kAllPairs;
}

bool some_face_about(const Cores& cores, const EdgeSeparation& edges, double least) {
  for (const int side : {0, 1}) {
    const PlacedCore& own = cores[side];
    const Vector3d low = in_own_frame(own, side == 0 ? edges.points.b : edges.points.a);
    const auto parts = [&](int face) {
      return height_over(own.core->faces[face], low) > least && separation_of(cores, side, face).separation > least;
    };
    for (const int vertex : {edges.edges[side].first, edges.edges[side].second}) {
      if (std::ranges::any_of(own.core->vertex_faces[vertex], parts)) return true;
    }
  }
  return false;
}

EdgeSeparation separation_of(const Cores& cores, const EdgePair& edges, const Vector3d& direction) {
  const Segment a = segment_of(cores[0], edges[0]), b = segment_of(cores[1], edges[1]);
  const ClosestPoints points = closest_points(a, b);
  EdgeSeparation result{.distance = (points.a - points.b).norm(), .points = points, .edges = edges};
  const Vector3d u = a.end - a.start, v = b.end - b.start;
  const bool touch = result.distance <= proof_tolerance(cores, result.distance);
  const Vector3d n = touch ? Vector3d(u.cross(v)) : Vector3d(points.a - points.b);
  const double length = n.norm();
  if (touch && length <= kParallel * u.norm() * v.norm()) return result;
  result.normal = n / (n.dot(direction) < 0.0 ? -length : length);
  result.separation = separation_along(cores, result.normal);
  return result;
}

EdgeSeparation largest_edge_separation(NarrowScratch& scratch, const Vector3d& direction) {
  EdgeSeparation best{.normal = direction};
  for (int round = 0; round < kRounds; ++round) {
    gather_both(scratch, best.normal);
    EdgeSeparation closest = closest_edges(scratch);
    const double tolerance = proof_tolerance(scratch.cores, closest.distance);
    // Of cores that touch, the direction between the points has no digits.
    if (closest.distance > tolerance) {
      closest.separation = separation_along(scratch.cores, closest.normal);
      if (closest.separation >= closest.distance - tolerance) return closest;
    }
    const EdgeSeparation crossing = deepest_crossing(scratch, best.normal);
    const EdgeSeparation& better = crossing.separation > closest.separation ? crossing : closest;
    if (better.separation <= best.separation) break;
    best = better;
    if (tries_all_edges(scratch.cores)) break;
  }
  return best.separation == -std::numeric_limits<double>::infinity() ? touching(scratch) : best;
}

}  // namespace layfigure::collision
