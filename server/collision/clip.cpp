#include "clip.h"

#include <algorithm>

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;

// Of a corner that no side has cut yet: farther inside than anything.
constexpr double kNotClipped = -1e300;

static_assert(kMaxHullVertices <= kFirstSide);

void load_facing(const PlacedCore& other, int facing, std::vector<Corner>& polygon) {
  polygon.clear();
  const int n = static_cast<int>(facing < 0 ? other.vertices.size() : other.core->faces[facing].loop.size());
  const bool closed = facing >= 0;
  const auto vertex = [&](int k) { return closed ? other.core->faces[facing].loop[k] : k; };
  for (int k = 0; k < n; ++k) {
    const int before = k > 0 || closed ? vertex((k + n - 1) % n) : kNoLine;
    const int after = k + 1 < n || closed ? vertex(k) : kNoLine;
    polygon.push_back({other.vertices[vertex(k)], before, after, kNotClipped});
  }
}

/// Sutherland and Hodgman's step: keeps what lies behind the line `side` through `origin`.
void clip_side(const Vector3d& outward, const Vector3d& origin, double slack, int side, bool closed,
               NarrowScratch& scratch) {
  scratch.clipped.clear();
  const auto& polygon = scratch.polygon;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Corner& corner = polygon[k];
    const double height = outward.dot(corner.p - origin);
    if (height <= slack) {
      scratch.clipped.push_back(corner);
      scratch.clipped.back().outside = std::max(corner.outside, height);
    }
    if (!closed && k + 1 == polygon.size()) break;
    const Corner& next = polygon[(k + 1) % polygon.size()];
    const double next_height = outward.dot(next.p - origin);
    const bool leaves = height <= slack && next_height > slack, enters = height > slack && next_height <= slack;
    if (!leaves && !enters) continue;
    // Within the slack both may lie outside the line itself: then the nearer one stands for the crossing.
    const double fraction = std::clamp(height / (height - next_height), 0.0, 1.0);
    const auto between = [fraction](double from, double to) { return from + fraction * (to - from); };
    const Vector3d p = corner.p + fraction * (next.p - corner.p);
    // A convex function of the place, so it is at most this.
    const double outside = std::max(between(height, next_height), between(corner.outside, next.outside));
    scratch.clipped.push_back(leaves ? Corner{p, corner.after, side, outside} : Corner{p, side, corner.after, outside});
  }
  std::swap(scratch.polygon, scratch.clipped);
}

}  // namespace

void clip_facing(const FaceRef& face, double slack, NarrowScratch& scratch) {
  const PlacedCore& own = scratch.cores[face.side];
  const PlacedCore& other = scratch.cores[1 - face.side];
  load_facing(other, face.facing, scratch.polygon);
  const auto& loop = own.core->faces[face.face].loop;
  const Vector3d n = own.normal(face.face);
  const bool closed = face.facing >= 0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Vector3d& from = own.vertices[loop[k]];
    const Vector3d outward = (own.vertices[loop[(k + 1) % loop.size()]] - from).cross(n).normalized();
    clip_side(outward, from, slack, kFirstSide + static_cast<int>(k), closed, scratch);
  }
}

}  // namespace layfigure::collision
