#pragma once

#include <Eigen/Core>

namespace layfigure::skinning {

/// A point of a triangle. On an edge or corner the coordinates of the corners that it is away from are exactly 0.
struct TrianglePoint {
  Eigen::Vector3d barycentric{Eigen::Vector3d::Zero()};  ///< >= 0, sum 1
  Eigen::Vector3d point{Eigen::Vector3d::Zero()};
};

/// The point of the triangle a b c that is closest to p: p's projection on the triangle's plane if that is within the
/// triangle, else the closest of the edges that it is beyond; of a triangle that has collapsed, the closest of all
/// edges. Off by rounding over the sine of the triangle's angle at a, at most 1e-8 of its size.
[[nodiscard]] TrianglePoint closest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                                const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace layfigure::skinning
