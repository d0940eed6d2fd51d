#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <variant>
#include <vector>

namespace layfigure::collision {

/// A rigid transform: p_W = rotation p_B + position for X_WB.
struct Pose {
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< R, unit
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};            ///< [m]
};

/// A ball about the shape frame's origin.
struct Sphere {
  double radius{0.05};  ///< [m], >= 0
};

/// All points within `radius` of the segment from -half_length to half_length on the shape frame's z axis.
struct Capsule {
  double radius{0.05};      ///< [m], >= 0
  double half_length{0.1};  ///< [m], >= 0; 0: a sphere
};

/// Most vertices that a hull may be given: its faces are found from all triples of them.
inline constexpr int kMaxHullVertices = 256;

/// The convex hull of points in the shape's frame, given in any order, inner and repeated ones among them. It may be
/// flat, a segment or a point.
struct ConvexHull {
  std::vector<Eigen::Vector3d> vertices;  ///< [m], 1 to kMaxHullVertices
};

/// The half-space z <= 0 of the shape's frame is solid: the floor.
struct Plane {};

using Shape = std::variant<Sphere, Capsule, ConvexHull, Plane>;

/// Radius of the ball about the shape frame's origin that holds the shape [m]; 0 for a plane, which none does.
[[nodiscard]] double radius_of(const Shape& shape);

/// The body index of what does not move: the floor, a table.
inline constexpr int kWorldBody = -1;

/// A shape on a body.
struct ShapeDefinition {
  std::string name;  ///< for error messages
  Shape shape{Sphere{}};
  int body{kWorldBody};  ///< index of the body that carries it, or kWorldBody
  Pose X_BS{};           ///< the shape's frame in the body's
  double friction{0.5};  ///< Coulomb coefficient, >= 0; a contact takes the geometric mean of its two
  int group{0};          ///< shapes of one group other than 0 never meet: a doll whose limbs may cross
};

}  // namespace layfigure::collision
