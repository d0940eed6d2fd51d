#include "reference.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace layfigure::collision::testing {
namespace {

using Eigen::Vector3d;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double separation(const Points& a, const Points& b, const Vector3d& n) {
  double low = kInfinity, high = -kInfinity;
  for (const auto& v : a) low = std::min(low, n.dot(v));
  for (const auto& v : b) high = std::max(high, n.dot(v));
  return low - high;
}

Points directions(const Points& points) {
  Points result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) result.push_back(points[i] - points[j]);
  }
  return result;
}

void raise(const Points& a, const Points& b, const Vector3d& u, const Vector3d& v, double& best) {
  const Vector3d n = u.cross(v);
  const double length = n.norm();
  if (length <= 1e-9 * u.norm() * v.norm()) return;
  best = std::max({best, separation(a, b, n / length), separation(a, b, -n / length)});
}

double point_segment(const Vector3d& p, const Vector3d& from, const Vector3d& to) {
  const Vector3d d = to - from;
  const double t = d.isZero(0.0) ? 0.0 : std::clamp(d.dot(p - from) / d.squaredNorm(), 0.0, 1.0);
  return (p - from - t * d).norm();
}

/// The distance of two segments: at an end of one, or at the common perpendicular's feet.
double segment_segment(const Vector3d& a0, const Vector3d& a1, const Vector3d& b0, const Vector3d& b1) {
  double best = std::min(
      {point_segment(a0, b0, b1), point_segment(a1, b0, b1), point_segment(b0, a0, a1), point_segment(b1, a0, a1)});
  const Vector3d u = a1 - a0, v = b1 - b0, n = u.cross(v), w = b0 - a0;
  if (n.norm() <= 1e-9 * u.norm() * v.norm()) return best;
  const double s = w.cross(v).dot(n) / n.squaredNorm(), t = w.cross(u).dot(n) / n.squaredNorm();
  if (s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0) best = std::min(best, (a0 + s * u - b0 - t * v).norm());
  return best;
}

/// The height of p over the triangle if it lies over it.
double point_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d n = (b - a).cross(c - a);
  if (n.norm() < 1e-12) return kInfinity;
  const bool over =
      n.dot((b - a).cross(p - a)) >= 0.0 && n.dot((c - b).cross(p - b)) >= 0.0 && n.dot((a - c).cross(p - c)) >= 0.0;
  return over ? std::abs(n.dot(p - a)) / n.norm() : kInfinity;
}

double least_over_triangles(const Points& triangles, const Points& points) {
  double best = kInfinity;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      for (std::size_t k = 0; k < j; ++k) {
        for (const auto& p : points) {
          best = std::min(best, point_triangle(p, triangles[i], triangles[j], triangles[k]));
        }
      }
    }
  }
  return best;
}

double least_between_segments(const Points& a, const Points& b) {
  double best = kInfinity;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      for (std::size_t k = 0; k < b.size(); ++k) {
        for (std::size_t l = 0; l <= k; ++l) best = std::min(best, segment_segment(a[i], a[j], b[k], b[l]));
      }
    }
  }
  return best;
}

}  // namespace

double largest_separation(const Points& a, const Points& b) {
  double best = -kInfinity;
  const Points along_a = directions(a), along_b = directions(b);
  for (const auto* own : {&along_a, &along_b}) {
    for (const auto& u : *own) {
      for (const auto& v : *own) raise(a, b, u, v, best);
    }
  }
  for (const auto& u : along_a) {
    for (const auto& v : along_b) raise(a, b, u, v, best);
  }
  return best;
}

double signed_distance(const Points& a, const Points& b) {
  const double distance =
      std::min({least_between_segments(a, b), least_over_triangles(a, b), least_over_triangles(b, a)});
  const double along_axes = largest_separation(a, b);
  // Hulls that do not overlap are parted by one of these axes (the separating axis theorem).
  return along_axes > 0.0 ? distance : along_axes;
}

}  // namespace layfigure::collision::testing
