#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace layfigure::collision {

/// One point where two bodies touch or are about to. gap = normal_W . (p_Wa - p_Wb).
struct ContactPoint {
  int body_a;                ///< never the world
  int body_b;                ///< may be kWorldBody
  int shape_a;               ///< index into WorldDefinition::shapes
  int shape_b;               ///< index into WorldDefinition::shapes
  Eigen::Vector3d p_Wa;      ///< on the surface of a, world [m]
  Eigen::Vector3d p_Wb;      ///< on the surface of b, world [m]
  Eigen::Vector3d normal_W;  ///< unit, from b to a
  double gap;                ///< [m]; negative: penetration
  double friction;           ///< Coulomb coefficient, >= 0
  std::uint64_t feature;     ///< with shape_a and shape_b, names the point from one update to the next (warm start)
};

}  // namespace layfigure::collision
