#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "surface.h"

namespace layfigure::doll {

/// Moments of a plane figure.
struct PlaneFigure {
  double area{0.0};                                        ///< [m^2]
  Eigen::Vector2d centroid{Eigen::Vector2d::Zero()};       ///< [m]
  Eigen::Matrix2d second_moment{Eigen::Matrix2d::Zero()};  ///< int (x - c)(x - c)^T dA about the centroid c [m^4]
  double outermost{0.0};                                   ///< largest distance of a corner from the centroid [m]

  /// I, the mean of the two principal second moments [m^4]: half the polar moment J.
  [[nodiscard]] double mean_second_moment() const { return 0.5 * second_moment.trace(); }
};

/// Of a simple polygon, by Green's theorem: with d = x_k x y_(k+1) - x_(k+1) y_k over the edges
///     A = sum d / 2,   A c = sum d (p_k + p_(k+1)) / 6,
///     int x x^T = sum d (p_k p_k^T + p_(k+1) p_(k+1)^T + s s^T) / 24 with s = p_k + p_(k+1) .
/// Clockwise ones count as counter-clockwise. Fewer than three corners: all 0.
[[nodiscard]] PlaneFigure plane_figure(const std::vector<Eigen::Vector2d>& polygon);

/// Where a surface is cut, and what of it counts.
struct Cut {
  Eigen::Vector3d point;   ///< on the plane
  Eigen::Vector3d normal;  ///< unit
  int owner;               ///< only where this one weighs at least kLeastShare
  int other{-1};           ///< or this one; -1: none
};

/// The part of the cut that belongs to the limb about `cut.point`: of all loops the largest that has the point inside,
/// else the nearest. A chain that ends where the owner's weight fades out is closed by its chord. Nothing if there is
/// no loop.
[[nodiscard]] std::optional<PlaneFigure> cut_surface(const Surface& surface, const Cut& cut);

}  // namespace layfigure::doll
