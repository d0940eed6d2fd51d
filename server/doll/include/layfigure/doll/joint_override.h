#pragma once

#include <array>
#include <optional>
#include <string>

namespace layfigure::doll {

/// What a settings file says somewhere, and the line where it does; 0: said by no file.
template <class T>
struct Entry {
  T value{};
  int line{0};
};

template <class T>
using OptionalEntry = std::optional<Entry<T>>;

/// A number given outright, or as a multiple of the one that was chosen for the joint.
struct Amount {
  double number{1.0};
  bool is_factor{false};

  [[nodiscard]] double of(double chosen) const { return is_factor ? number * chosen : number; }
};

/// One for each axis of the joint's section: twist, bend_y, bend_z. Those that are not given stay as chosen.
using AxisAmounts = std::array<std::optional<Amount>, 3>;

/// How far a joint turns about one axis of its limits, from its neutral pose [rad]; from -pi or to pi: freely that way.
struct AngleRange {
  double lower{0.0};  ///< in [-pi, 0]
  double upper{0.0};  ///< in [0, pi]
};

/// What a body is to other bodies that it meets.
enum class ShapeKind {
  kHull,     ///< the convex hull of its skin
  kCapsule,  ///< the capsule that fits its skin best
  kNone,     ///< nothing: others pass through it
};

/// Departures from what build_doll() chooses, of the bones that a pattern names. What is not given stays as chosen.
struct JointOverride {
  std::string pattern;  ///< a bone's name, or one with * (any characters, or none) and ? (any one character)
  int line{0};          ///< of the table in the settings file

  OptionalEntry<Amount> stiffness{};     ///< K_f [N m/rad], >= 0; infinity: rigid until it yields
  OptionalEntry<Amount> damping{};       ///< D_f [N m s/rad], >= 0
  OptionalEntry<Amount> flow_damping{};  ///< D_d [N m s/rad], >= 0
  OptionalEntry<Amount> yield_torque{};  ///< t_y [N m], >= 0; infinity: never yields
  OptionalEntry<Amount> hardening{};     ///< H [N m/rad], >= 0

  OptionalEntry<AxisAmounts> stiffness_axes{};     ///< of single axes; not beside stiffness
  OptionalEntry<AxisAmounts> damping_axes{};       ///< not beside damping
  OptionalEntry<AxisAmounts> yield_torque_axes{};  ///< > 0; not beside yield_torque

  OptionalEntry<AngleRange> twist{};
  OptionalEntry<AngleRange> swing_y{};
  OptionalEntry<AngleRange> swing_z{};
  OptionalEntry<std::array<bool, 3>> locked{};  ///< twist, bend_y, bend_z: axes that do not turn

  OptionalEntry<bool> merge{};       ///< true: rides on the body of its parent bone; false: is a body
  OptionalEntry<ShapeKind> shape{};  ///< in contacts
  OptionalEntry<double> friction{};  ///< Coulomb's coefficient, >= 0
  OptionalEntry<double> density{};   ///< [kg/m^3], > 0; not beside mass
  OptionalEntry<double> mass{};      ///< [kg], > 0
};

}  // namespace layfigure::doll
