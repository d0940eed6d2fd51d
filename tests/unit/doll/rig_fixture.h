#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "layfigure/character/rig.h"
#include "layfigure/doll/settings.h"

namespace layfigure::doll::test {

/// A straight prism along +Z of its pose, its cross-section a regular polygon, one bone after the other along it. The
/// vertices weigh upon the bone that they lie beside, those of a ring at a joint upon both, half and half.
struct Prism {
  std::string prefix{"bone"};  ///< bones are called prefix0, prefix1, ..
  int bones{2};
  double bone_length{0.3};  ///< [m]
  int sides{4};
  double radius{0.05};  ///< of the polygon's corners [m]
  int rings_per_bone{4};
  Eigen::Isometry3d pose{Eigen::Isometry3d::Identity()};  ///< of the prism's foot in the world

  [[nodiscard]] double side() const;
  [[nodiscard]] double area() const;
  /// I of the polygon, the same about every axis through its centre.
  [[nodiscard]] double second_moment() const;
};

/// Adds the prism's bones below `parent` (-1: none), each bone's frame turned so that its Y axis is along the prism,
/// and its mesh.
void add_prism(character::Rig& rig, const Prism& prism, int parent);

[[nodiscard]] character::Rig make_prism(const Prism& prism);

/// The whole rig moved rigidly.
[[nodiscard]] character::Rig moved(character::Rig rig, const Eigen::Isometry3d& motion);

/// The whole rig mirrored at the plane x = 0: a bone's frame too, and its own x turned round to keep it right-handed.
[[nodiscard]] character::Rig mirrored(character::Rig rig);

/// The whole rig this many times as large.
[[nodiscard]] character::Rig scaled(character::Rig rig, double factor);

/// An adult of cylinders, arms held out sideways: bones trunk0 trunk1 (upwards from z = 1 m), left0 left1 left2 (upper
/// arm, forearm, hand), the same on the right.
[[nodiscard]] character::Rig make_adult();

/// The same with flat limbs: the trunk and the arms half as deep as wide, the arms aslant to their bones' axes.
[[nodiscard]] character::Rig make_flat_adult();

/// Settings whose minima do nothing, so that the joints are as the cross-sections make them.
[[nodiscard]] DollSettings without_minima();

/// Any rigid motion that is no special case.
[[nodiscard]] Eigen::Isometry3d odd_motion();

}  // namespace layfigure::doll::test
