#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace layfigure::doll {

/// Of a solid of density 1, in the axes of the points that it was made from.
struct MassProperties {
  double volume{0.0};                                ///< [m^3]
  Eigen::Vector3d com{Eigen::Vector3d::Zero()};      ///< [m]
  Eigen::Matrix3d inertia{Eigen::Matrix3d::Zero()};  ///< about the com [m^5]
  bool estimated{false};                             ///< the part encloses hardly anything: a capsule instead
};

/// The open edges of a part of a surface as closed loops of vertices, in the direction of the triangles that they
/// bound. Every open edge is in one loop, whatever the mesh. O(n log n).
[[nodiscard]] std::vector<std::vector<int>> boundary_loops(std::span<const Eigen::Vector3i> part);

/// Integrals over the solid that the part encloses, each open loop closed by a fan to its centroid. By the divergence
/// theorem, a sum over the tetrahedra
/// (o, a, b, c) of all triangles, for which with V = det(a, b, c) / 6 and s = a + b + c
///     int 1 = V,   int x = V s / 4,   int x x^T = V (a a^T + b b^T + c c^T + s s^T) / 20 .
/// If the volume is less than 2 % of the sphere's of that area, or the second moments are not positive, the properties
/// are those of the capsule in the bounding box of the part along `axes`: as long as the box's longest side, as thick
/// as the circle of its two other sides' area (half sides below 5 % of the longest count as that), but never thicker
/// than long. O(n log n).
[[nodiscard]] MassProperties mass_properties(std::span<const Eigen::Vector3i> part,
                                             const std::vector<Eigen::Vector3d>& points, const Eigen::Matrix3d& axes);

}  // namespace layfigure::doll
