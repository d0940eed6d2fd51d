#pragma once

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "layfigure/doll/joint_override.h"
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

  OptionalEntry<double> total_mass;   ///< of the whole doll [kg], > 0: scales every density to it
  std::vector<JointOverride> joints;  ///< in the file's order: the later one holds, a bone's own name above all

  std::string source;                ///< the file that they were read from, empty: none
  std::map<std::string, int> lines;  ///< of the numbers that the file gives, by name
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

/// Where the settings of a character are looked for: character.glb -> character.doll.toml, in the same folder.
[[nodiscard]] std::filesystem::path settings_path_beside(const std::filesystem::path& character);

/// Reads a TOML file of `field = number` lines, named as in DollSettings, of the material that those which are not
/// given default to, and of tables for single bones, all optional:
///
///     material = "wood"
///     yield_stress = 8.0e4
///     total_mass = 12.0                 # kg
///
///     [joints."*Arm"]                   # a bone's name, or a pattern: * any characters, ? any one
///     damping = 0.2                     # N m s/rad
///     yield_torque = {factor = 2.0}     # twice what was chosen; the others likewise
///     stiffness = {twist = 9.0, bend_y = {factor = 0.5}}    # of single axes; damping, yield_torque likewise
///     limits = {twist = [-30, 30], swing_y = [-10, 140], swing_z = [-5, 5]}    # degrees
///     locked = ["twist"]                # of twist, bend_y, bend_z
///     merge = false                     # true: rides on its parent's body; false: is a body
///     shape = "hull"                    # or "capsule", "none"
///     friction = 0.6
///     mass = 0.4                        # kg; or density
///
/// Limits are measured from the joint's neutral pose, which must be within as well as the rest pose; it is the rest
/// pose unless the doll has chosen another. A limit of 180 degrees is none. A swing that may not leave the neutral pose
/// on one side (0) may by kLeastSwingDeg.
///
/// Throws SettingsError: no such file, not TOML, an unknown key or material, a value of the wrong kind or out of range.
[[nodiscard]] DollSettings load_settings(const std::filesystem::path& path);

/// The bounds of a swing are the semi-axes of an ellipse, which cannot vanish: the least that one can be [deg].
inline constexpr double kLeastSwingDeg = 1.0;

}  // namespace layfigure::doll
