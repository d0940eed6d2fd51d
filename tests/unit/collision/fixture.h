#pragma once

#include <random>
#include <vector>

#include "layfigure/collision/world.h"

namespace layfigure::collision::testing {

/// Shapes and poses from a fixed seed.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}

  double between(double low, double high);
  Eigen::Vector3d direction();
  Eigen::Quaterniond rotation();
  /// `count` points between 0.7 and 1 times `size` from the origin.
  std::vector<Eigen::Vector3d> cloud(int count, double size);

 private:
  std::mt19937_64 engine_;
};

/// The corners of a box about the origin.
ConvexHull box(const Eigen::Vector3d& half);

/// A world of two bodies, a shape on each.
WorldDefinition pair_of(Shape a, Shape b, double activity);

/// The contacts of those two at their poses.
std::vector<ContactPoint> contacts_of(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                                      double activity = 0.02);

/// A doll of `count` limbs, hulls of 32 vertices in a row along x, those next to each other excluded.
WorldDefinition limbs(int count);
std::vector<Pose> limb_poses(int count, double height);

/// The smallest gap; infinity if there is no contact.
double least_gap(std::span<const ContactPoint> contacts);

/// Expects that gaps, points and normals agree with each other.
void expect_consistent(std::span<const ContactPoint> contacts);

/// Equality of every bit.
bool same(std::span<const ContactPoint> a, std::span<const ContactPoint> b);

}  // namespace layfigure::collision::testing
