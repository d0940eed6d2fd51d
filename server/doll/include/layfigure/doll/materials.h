#pragma once

#include <span>
#include <string_view>

namespace layfigure::doll {

/// What a limb is made of: the values of a solid of the skin's outer shape that would behave like the limb does. Where
/// the limb is hollow, a wire or a friction joint, they are effective values, derived in materials.cpp.
struct Material {
  std::string_view name;
  double density;          ///< [kg/m^3], > 0
  double elastic_modulus;  ///< e of K_f [Pa], >= 0
  double poisson_ratio;    ///< nu: the shear modulus is e / (2 (1 + nu)), in (-1, 0.5]
  double viscosity;        ///< e of D_f [Pa s], >= 0
  double flow_viscosity;   ///< e of D_d [Pa s], >= 0
  double yield_stress;     ///< in tension [Pa], >= 0
  double hardening;        ///< growth of the yield stress with the plastic strain [Pa], >= 0
};

/// "soft vinyl", "wood", "wire armature" and "clay".
[[nodiscard]] std::span<const Material> materials();

/// Soft vinyl.
[[nodiscard]] const Material& default_material();

/// nullptr if there is none of that name.
[[nodiscard]] const Material* find_material(std::string_view name);

}  // namespace layfigure::doll
