#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "closest_point.h"
#include "ray.h"

namespace layfigure::skinning {

/// A tree of axis-aligned boxes about triangles whose vertices move. Its shape is made once; what follows the vertices
/// is the boxes.
///
/// Own code: Bullet's btOptimizedBvh and Embree are in single precision, which is 0.1 um for a person, and the former
/// finds no closest points; CGAL's tree can only be built anew.
///
/// The triangles are halved at the median of their centres along the longest axis, so that 2^d of them give a tree of
/// depth d whatever their shape. Queries go down the nearer branch first and leave out what is farther than the best
/// found: O(log n) for a point near the triangles or a ray at them; at worst, as far from all, O(n).
class TriangleTree {
 public:
  struct Closest {
    int triangle{-1};
    TrianglePoint on_triangle;
    double squared_distance{0.0};  ///< [m^2]
  };
  struct Hit {
    int triangle{-1};
    RayCrossing crossing;
  };

  /// `positions` hold the triangles' vertices. O(n log n).
  TriangleTree(std::span<const Eigen::Vector3i> triangles, std::span<const Eigen::Vector3d> positions);

  /// The boxes about the triangles where their vertices are now. O(n), allocates nothing.
  void refit(std::span<const Eigen::Vector3d> positions);

  /// `positions` as in the last refit(). Nothing if there is no triangle or the point is not finite.
  [[nodiscard]] std::optional<Closest> closest(std::span<const Eigen::Vector3d> positions,
                                               const Eigen::Vector3d& p) const;
  /// The first crossing along the ray.
  [[nodiscard]] std::optional<Hit> cast(std::span<const Eigen::Vector3d> positions, const Ray& ray) const;

 private:
  /// A leaf has triangles_[first] and the count - 1 after it. Else count is 0, the left child is the next node, the
  /// right one node `first`.
  struct alignas(64) Node {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
    int first{0};
    int count{0};
  };
  struct Leaf {
    Eigen::Vector3i corners;
    int triangle;
  };

  int build(int begin, int end, const std::vector<Eigen::Vector3d>& centres);
  template <class Bound, class Visit>
  void descend(const Bound& bound, const Visit& visit, const double& limit) const;

  std::vector<Node> nodes_;  ///< parents before children
  std::vector<Leaf> triangles_;
};

}  // namespace layfigure::skinning
