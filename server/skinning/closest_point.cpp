#include "closest_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace layfigure::skinning {
namespace {

using Eigen::Vector3d;

/// Sine of the angle at a below which a triangle has collapsed: its edges are then as close to all of it as rounding
/// leaves its barycentric coordinates right.
constexpr double kCollapsedSine = 1e-8;

/// The closest point of the edge from corner i at a to corner j at b.
TrianglePoint closest_on_edge(const Vector3d& p, const Vector3d& a, const Vector3d& b, int i, int j) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  TrianglePoint closest;
  closest.barycentric[i] = 1.0 - t;
  closest.barycentric[j] = t;
  closest.point = t == 1.0 ? b : Vector3d(a + t * ab);
  return closest;
}

bool has_collapsed(const Vector3d& ab, const Vector3d& ac, const Vector3d& normal) {
  return !(normal.squaredNorm() > kCollapsedSine * kCollapsedSine * ab.squaredNorm() * ac.squaredNorm());
}

}  // namespace

TrianglePoint closest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const Vector3d bc = c - b;
  const Vector3d ap = p - a;
  const Vector3d normal = ab.cross(ac);
  const bool collapsed = has_collapsed(ab, ac, normal);
  // Of the triangles that p's projection makes with the edges, as multiples of one number.
  const Vector3d areas(normal.dot(bc.cross(p - b)), normal.dot(ap.cross(ac)), normal.dot(ab.cross(ap)));
  if (!collapsed && areas.minCoeff() > 0.0) {
    const Vector3d barycentric = areas / areas.sum();
    return {barycentric, a + barycentric[1] * ab + barycentric[2] * ac};
  }

  TrianglePoint best;
  double least = std::numeric_limits<double>::infinity();
  const auto try_edge = [&](const Vector3d& from, const Vector3d& to, int i, int j) {
    const TrianglePoint candidate = closest_on_edge(p, from, to, i, j);
    const double distance = (candidate.point - p).squaredNorm();
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  };
  if (collapsed || areas[0] <= 0.0) try_edge(b, c, 1, 2);
  if (collapsed || areas[1] <= 0.0) try_edge(c, a, 2, 0);
  if (collapsed || areas[2] <= 0.0) try_edge(a, b, 0, 1);
  return best;
}

}  // namespace layfigure::skinning
