#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace layfigure::collision {

struct Segment {
  Eigen::Vector3d start;
  Eigen::Vector3d end;
};

struct ClosestPoints {
  Eigen::Vector3d a;
  Eigen::Vector3d b;
};

/// Where on the segment, from 0 at its start to 1 at its end, it is closest to p.
inline double closest_fraction(const Segment& segment, const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = segment.end - segment.start;
  const double length2 = d.squaredNorm();
  return length2 > 0.0 ? std::clamp(d.dot(p - segment.start) / length2, 0.0, 1.0) : 0.0;
}

inline Eigen::Vector3d point_at(const Segment& segment, double fraction) {
  return segment.start + fraction * (segment.end - segment.start);
}

/// The closest points of two segments, either of which may be a point. The distance is exact to rounding; of parallel
/// segments, one of the closest pairs.
inline ClosestPoints closest_points(const Segment& a, const Segment& b) {
  const Eigen::Vector3d u = a.end - a.start, v = b.end - b.start, w = a.start - b.start;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm();
  const double determinant = uu * vv - uv * uv;
  // Least squares for both lines; then each in turn clamped and the other made closest to it.
  double s = 0.0;
  if (determinant > 0.0) s = std::clamp((uv * v.dot(w) - vv * u.dot(w)) / determinant, 0.0, 1.0);
  const double t = closest_fraction(b, point_at(a, s));
  const Eigen::Vector3d on_b = point_at(b, t);
  return {point_at(a, closest_fraction(a, on_b)), on_b};
}

}  // namespace layfigure::collision
