#pragma once

#include <Eigen/Core>
#include <memory>

#include "polytope.h"

namespace layfigure::collision {

/// A core in single precision, shrunk about its centre, for finding the direction that parts it from another.
class ShrunkCore {
 public:
  explicit ShrunkCore(const Polytope& core);
  ~ShrunkCore();
  ShrunkCore(ShrunkCore&&) noexcept;
  ShrunkCore& operator=(ShrunkCore&&) noexcept;

  struct Hull;
  [[nodiscard]] const Hull& hull() const { return *hull_; }

 private:
  std::unique_ptr<Hull> hull_;
};

/// Approximately the unit direction from b to a along which the two are farthest apart, or overlap least, in a's body
/// frame; R_AB and p_AB place b's body in it. Zero if the search failed. By Bullet's GJK, and its EPA where even the
/// shrunk cores overlap. No allocation.
[[nodiscard]] Eigen::Vector3d separating_direction(const ShrunkCore& a, const ShrunkCore& b,
                                                   const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& p_AB);

}  // namespace layfigure::collision
