#pragma once

#include <Eigen/Core>
#include <vector>

namespace layfigure::doll {

using Polygon = std::vector<Eigen::Vector2d>;  ///< closed: the last corner is joined to the first

/// Moments of a plane figure.
struct PlaneFigure {
  double area{0.0};                                        ///< [m^2]
  Eigen::Vector2d centroid{Eigen::Vector2d::Zero()};       ///< [m]
  Eigen::Matrix2d second_moment{Eigen::Matrix2d::Zero()};  ///< int (x - c)(x - c)^T dA about the centroid c [m^4]
  Polygon outline;                                         ///< the corners that can be outermost

  /// Largest distance of the outline from the centroid [m].
  [[nodiscard]] double outermost() const;
  /// The same along `direction`, a unit vector: from the axis across it through the centroid [m].
  [[nodiscard]] double outermost(const Eigen::Vector2d& direction) const;
};

/// Of polygons that do not cross: the first is the outline, those that run round the other way are holes in it, the
/// others islands in these. By Green's theorem: with d = x_k x y_(k+1) - x_(k+1) y_k over all edges
///     A = sum d / 2,   A c = sum d (p_k + p_(k+1)) / 6,
///     int x x^T = sum d (p_k p_k^T + p_(k+1) p_(k+1)^T + s s^T) / 24 with s = p_k + p_(k+1) .
/// An outline that runs clockwise counts as counter-clockwise. What has no area, or crosses itself so that a second
/// moment is not positive, is nothing: all 0. O(corners).
[[nodiscard]] PlaneFigure plane_figure(const std::vector<Polygon>& polygons);

/// Twice the area, positive if the polygon runs counter-clockwise [m^2].
[[nodiscard]] double twice_signed_area(const Polygon& polygon);

/// By the number of edges that the ray from `point` along +x crosses.
[[nodiscard]] bool contains(const Polygon& polygon, const Eigen::Vector2d& point);

/// The principal axis of bending about which the second moment is largest, as a unit vector: the limb is stiffest
/// against bending about it. It is on the side of +x of the plane (or, if it is nearly across x, on that of -y). A
/// figure whose principal second moments differ by less than kRound of their sum is round: there the axis would hang
/// on rounding and on the mesh's facets, and +x is taken.
[[nodiscard]] Eigen::Vector2d major_axis(const PlaneFigure& figure);

/// A law that is off by this share cannot be felt, and a regular polygon of a mesh in single precision is well within.
inline constexpr double kRound = 0.01;

}  // namespace layfigure::doll
