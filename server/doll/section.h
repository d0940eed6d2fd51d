#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "layfigure/doll/doll.h"
#include "plane_figure.h"
#include "surface.h"

namespace layfigure::doll {

/// Where a surface is cut, and what of it counts.
struct Cut {
  Eigen::Vector3d point;  ///< on the plane
  Eigen::Matrix3d axes;   ///< R_WC: x the plane's normal, y and z the axes in it that the figure is measured in
  int owner;              ///< only where this one weighs at least kLeastShare
  int other{-1};          ///< or this one; -1: none
};

/// R_WC of a cut across `normal`, a unit vector, from the axes of its bone R_WB: y is one of the bone's own axes, laid
/// into the plane, and so is turned, moved and mirrored with the bone. Of the bone's x, y, z it is the one after the
/// axis that the normal is nearest to: z for a bone along its y.
[[nodiscard]] Eigen::Matrix3d cut_axes(const Eigen::Vector3d& normal, const Eigen::Matrix3d& bone);

/// The part of the cut that belongs to the limb about `cut.point`: of all loops the largest that has the point inside,
/// else the nearest; less the holes in it, which run round the other way (a hollow limb), and with what is inside them.
/// Loops within it that run the same way are skin under skin and count no more. A rim that is broken, where the owner's
/// weight fades out or the surface is not joined, is closed by the shortest chords. Nothing if there is no loop. In the
/// axes y, z of the cut, from its point.
/// O(triangles log(crossed triangles) + loops^2 corners).
[[nodiscard]] std::optional<PlaneFigure> cut_surface(const Surface& surface, const Cut& cut);

/// The section of that figure, but for its span. X_BC is the pose of the cut in the body's frame.
[[nodiscard]] Section principal_section(const PlaneFigure& figure, const Eigen::Isometry3d& X_BC);

/// The estimated section of a circle of this area. `axes` is R_BC.
[[nodiscard]] Section round_section(double area, const Eigen::Matrix3d& axes);

}  // namespace layfigure::doll
