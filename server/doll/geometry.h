#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "layfigure/doll/doll.h"
#include "surface.h"

namespace layfigure::doll {

/// What there is to see of a body.
struct BodyGeometry {
  Eigen::Vector3d com{Eigen::Vector3d::Zero()};
  /// Of the homogeneous ellipsoid with the body's mass and inertia: with principal moments I_k and mass m
  ///     a_k^2 = 5 (I_i + I_j - I_k) / (2 m) .
  std::array<Eigen::Vector3d, 3> semi_axes{};
  std::vector<Eigen::Vector3d> section;  ///< closed outline of the cut at its joint; empty: none was found
};

/// A doll as it can be drawn: in the bind pose, world axes [m].
struct Geometry {
  Surface surface;
  std::vector<int> body_of_triangle;  ///< -1: the triangle moves with no body
  std::vector<BodyGeometry> bodies;
};

/// O(triangles + bones).
[[nodiscard]] Geometry make_geometry(const Doll& doll);

}  // namespace layfigure::doll
