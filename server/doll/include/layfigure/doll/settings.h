#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "layfigure/doll/materials.h"

namespace layfigure::doll {

/// What a doll is made of. The material gives each joint its share by the mesh's cross-section there (build.h); the
/// limits below it then see to it that the doll can be posed and keeps its pose. The default, soft vinyl, makes a light
/// doll: an adult's size weighs about 14 kg, its arms yield to a pull of some 10 to 25 N at the wrist.
struct DollSettings {
  std::string material{default_material().name};               ///< the base that the numbers below were taken from
  double density{default_material().density};                  ///< [kg/m^3], > 0
  double elastic_modulus{default_material().elastic_modulus};  ///< e of K_f [Pa], >= 0
  double poisson_ratio{default_material().poisson_ratio};      ///< of twist against bend, in (-1, 0.5]
  double viscosity{default_material().viscosity};              ///< e of D_f [Pa s], >= 0
  double flow_viscosity{default_material().flow_viscosity};    ///< e of D_d [Pa s], >= 0
  double yield_stress{default_material().yield_stress};        ///< in tension [Pa], >= 0
  double hardening{default_material().hardening};              ///< e of H [Pa], >= 0

  double largest_sag{0.04};       ///< of a joint under its limb's weight, stretched out level [rad], in (0, 1]
  double largest_strain{0.2};     ///< of a joint before it yields: so far it springs back [rad], in (0, pi]
  double hold_margin{2.0};        ///< least yield torque as a multiple of that weight's torque, >= 1
  double damping_ratio{0.7};      ///< least, of a joint with its limb as it is posed at rest, in [0, 10]
  double largest_flow_rate{3.0};  ///< of a joint at twice its yield torque [rad/s], > 0
};

/// The default settings, but of that material.
[[nodiscard]] DollSettings settings_of(const Material& material);

/// A settings file that cannot be used. what() is one line with the file, the line, the key and the allowed range.
class SettingsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws std::invalid_argument that names the field, its value and what is allowed.
void validate(const DollSettings& settings);

/// Reads a TOML file of `field = number` lines, named as in DollSettings, all optional, and of the material that those
/// which are not given default to:
///
///     material = "wood"
///     yield_stress = 8.0e4
///
/// Throws SettingsError: no such file, not TOML, an unknown key or material, not a number, out of range.
[[nodiscard]] DollSettings load_settings(const std::filesystem::path& path);

}  // namespace layfigure::doll
