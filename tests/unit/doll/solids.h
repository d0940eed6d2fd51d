#pragma once

#include <Eigen/Core>
#include <vector>

#include "layfigure/character/rig.h"

namespace layfigure::doll::test {

/// A closed mesh, its triangles counter-clockwise from outside. The limbs among them lie along z about the origin.
struct Solid {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;
};

/// A row of a lathe's profile.
struct Turn {
  double z;
  double radius;  ///< 0: a pole
};

/// The profile turned about z, on `sides` facets, its corners on the curved surface. From one pole to the other,
/// outside from below to above; `closed`: back to its first row instead, without poles, which makes a ring.
[[nodiscard]] Solid turned(const std::vector<Turn>& profile, int sides, bool closed = false);

/// Each side in squares of two triangles, `cells` along each edge. About the origin.
[[nodiscard]] Solid box(const Eigen::Vector3d& size, int cells);

/// In `sides` facets, eight times as long as wide: a straight limb loses nothing by that.
[[nodiscard]] Solid cylinder(double radius, double length, int sides);

/// With a bore of `inner`; the walls in half as many rings as a cylinder of as many triangles has.
[[nodiscard]] Solid tube(double outer, double inner, double length, int sides);

/// `length` is that of the cylinder between the two hemispheres; each of these has sides / 8 rows.
[[nodiscard]] Solid capsule(double radius, double length, int sides);

/// Stretched along the axes.
[[nodiscard]] Solid stretched(Solid solid, const Eigen::Vector3d& factors);

/// A rig of two bones along z, bone0 from the solid's lowest point and bone1 from the height `joint`, that share its
/// skin there. Each bone's frame has y along the solid and z along the world's -y.
[[nodiscard]] character::Rig rig_of(const Solid& solid, double joint);

}  // namespace layfigure::doll::test
