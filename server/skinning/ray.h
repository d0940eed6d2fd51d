#pragma once

#include <Eigen/Core>
#include <optional>

namespace layfigure::skinning {

/// Where a ray meets a triangle.
struct RayCrossing {
  double distance{0.0};  ///< along the ray [m], >= 0
  Eigen::Vector3d barycentric{Eigen::Vector3d::Zero()};
};

/// A ray, prepared for many triangles and boxes. No ray slips between two triangles that share an edge (Woop, Benthin &
/// Wald 2013, "Watertight ray/triangle intersection", JCGT 2(1)), nor past the box of a triangle that it meets (Ize
/// 2013, "Robust BVH ray traversal", JCGT 2(2)).
class Ray {
 public:
  /// `direction` is unit.
  Ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

  [[nodiscard]] const Eigen::Vector3d& origin() const { return origin_; }
  [[nodiscard]] const Eigen::Vector3d& direction() const { return direction_; }

  /// Either side counts. A triangle that is seen edge on is not met.
  [[nodiscard]] std::optional<RayCrossing> cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                                 const Eigen::Vector3d& c) const;

  /// Distance to where the ray enters the box, 0 from within; infinity if it misses the box.
  [[nodiscard]] double enter(const Eigen::Vector3d& low, const Eigen::Vector3d& high) const;

 private:
  [[nodiscard]] Eigen::Vector3d sheared(const Eigen::Vector3d& p) const;

  Eigen::Vector3d origin_;
  Eigen::Vector3d direction_;
  Eigen::Vector3d inverse_;  ///< of the direction's components
  int x_, y_, z_;            ///< axes of the sheared frame, in which the ray runs along z
  Eigen::Vector3d shear_;
};

}  // namespace layfigure::skinning
