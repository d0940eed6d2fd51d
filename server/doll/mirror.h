#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "body_layout.h"

namespace layfigure::doll {

/// A character's symmetry in its bind pose: the plane normal . x = offset, and which body is which one's image in it.
struct Mirror {
  bool found{false};                                 ///< false: nothing below means anything
  Eigen::Vector3d normal{Eigen::Vector3d::UnitX()};  ///< unit, world; to the left, where names say which side that is
  double offset{0.0};                                ///< [m]
  std::vector<int> mirror_of_body;                   ///< itself for a body in the middle; -1: none

  [[nodiscard]] Eigen::Vector3d reflected(const Eigen::Vector3d& point) const;
  /// S = 1 - 2 n n^T
  [[nodiscard]] Eigen::Matrix3d reflection() const;
};

/// Finds the plane and the pairs. The plane is that of the bodies whose names differ in their side alone: its normal
/// the mean way from the right to the left ones. Without such names it is whichever plane between two bodies of one
/// parent mirrors the most bodies, half of them at least.
///
/// A body's image is the body on its parent's image whose joint and com are where the plane puts them, the nearest of
/// those within 3 % of the layout's extent. Names that say a side must agree. Pairs by name that are not where the
/// plane puts them are reported in one line.
///
/// O(bodies^2), without names O(pairs of siblings x bodies^2).
[[nodiscard]] Mirror find_mirror(const BodyLayout& layout, std::vector<std::string>& warnings);

}  // namespace layfigure::doll
