#pragma once

#include <Eigen/Core>

#include "layfigure/doll/doll.h"
#include "layfigure/doll/settings.h"
#include "layfigure/dynamics/model.h"

namespace layfigure::doll {

/// The law of a joint about each axis of its section: x twist, y and z bends.
struct AxisLaw {
  Eigen::Vector3d stiffness;     ///< [N m/rad]
  Eigen::Vector3d damping;       ///< [N m s/rad]
  Eigen::Vector3d yield_torque;  ///< [N m]
};

/// Of a bar of that section and material, as long as the two bodies' coms are apart (Saint-Venant's torsion of a
/// circle's section, and Bernoulli's bending). With g = (J / (2 (1 + nu)), I_y, I_z) / s
///     stiffness = elastic_modulus g,   damping = viscosity g,
///     yield_torque = yield_stress (J / (sqrt(3) c_x), I_y / c_y, I_z / c_z)
/// as the shear modulus is e / (2 (1 + nu)) and the yield stress in shear is that in tension over sqrt(3) (von Mises;
/// Hill, The Mathematical Theory of Plasticity, ch. 2).
///
/// J is the polar second moment, as in Matsunaga's Eq. 3-4. For a circle and a round tube that is Saint-Venant's
/// torsion constant; another section warps and is softer: an ellipse whose axes are as 1 to n by 4 n^2 / (1 + n^2)^2,
/// 0.64 for 1 to 2. That is on the safe side of what is seen, as most limbs are rounder, a joint of a doll is no long
/// bar that is free to warp, and the minima of build_doll() hold each axis by itself.
[[nodiscard]] AxisLaw axis_law(const Section& section, const DollSettings& settings);

/// The joint whose axes obey `law`. K_f, D_f and t_y are those of the weakest axis, with ratios of at least 1: it never
/// yields to a torque below t_y, whatever its direction. D_d and H are flow_viscosity g and hardening g of the axis
/// that yields first; as the flow is normal to the yield ellipsoid, about another axis, of yield ratio r, they are r^2
/// times as large.
[[nodiscard]] dynamics::JointLaw joint_law(const AxisLaw& law, const Section& section, const DollSettings& settings);

}  // namespace layfigure::doll
