#include "layfigure/doll/materials.h"

#include <algorithm>
#include <array>
#include <numbers>

namespace layfigure::doll {
namespace {

constexpr double square(double x) { return x * x; }
constexpr double cube(double x) { return x * x * x; }

/// Of a Kelvin-Voigt solid whose loss factor at `frequency` [Hz] is `loss_factor`: e tan(delta) / (2 pi f).
constexpr double viscosity_of(double modulus, double loss_factor, double frequency) {
  return modulus * loss_factor / (2.0 * std::numbers::pi * frequency);
}

/// A doll cast from plasticised PVC, hollow: a wall of 3 mm on a limb 27 mm in radius, 0.89 of it empty.
/// - Density 1200 kg/m^3 (Titow, PVC Technology, 4th ed., app. 1: 1160 to 1350 for flexible compounds), of the wall's
///   share of the area, 1 - 0.89^2.
/// - Shore A 29 makes e = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S)) MPa = 1.1 MPa (Gent, Rubber Chem.
///   Technol. 31 (1958) 896), of the wall's share of the second moment, 1 - 0.89^4.
/// - nu of a rubber, nearly incompressible (Nielsen and Landel, Mechanical Properties of Polymers and Composites, 2nd
///   ed., ch. 2).
/// - A loss factor of 0.16 at 1 Hz: 0.1 to 0.3 is usual well above the glass transition (there, ch. 4).
/// - No yield point is tabulated. Chosen: it keeps a set from 15 % strain on, creeping towards it within a second; so
///   an adult's arm yields to a pull of 10 to 25 N at the wrist.
constexpr Material soft_vinyl() {
  constexpr double kHollow = 0.89;
  constexpr double kModulus = 1.1e6 * (1.0 - square(square(kHollow)));
  return {.name = "soft vinyl",
          .density = 1200.0 * (1.0 - square(kHollow)),
          .elastic_modulus = kModulus,
          .poisson_ratio = 0.47,
          .viscosity = viscosity_of(kModulus, 0.16, 1.0),
          .flow_viscosity = 0.25 * kModulus,
          .yield_stress = 0.15 * kModulus,
          .hardening = 0.0};
}

/// A lay figure of beech, whose balls are drawn into their sockets by springs.
/// - Density of American beech at 12 % moisture: its specific gravity of 0.64 there counts the dry wood alone (Wood
///   Handbook, FPL-GTR-190, table 5-3), to which the water comes. nu = 0.37 along the grain (there, table 5-1, about
///   that of all hardwoods).
/// - Yield is slip. A spring's force N on a socket that touches the ball, of radius r, at 45 degrees, holds the torque
///   mu N r; the limb's section at the joint is the ball's, so that yield_stress pi r^3 / 4 = mu N r. Dry wood on wood
///   has mu = 0.4 (there, ch. 4: 0.3 to 0.5 on hard, smooth surfaces); 20 N on a ball of 7 mm are usual in a figure of
///   0.3 m.
/// - Before it slips it turns by 0.02 rad (chosen; the play of a good joint), with s = 7 r:
///   e = yield_stress s / (0.02 r). The beech itself, 11.9 GPa, is rigid beside that.
/// - A loss factor of 0.05, that of jointed timber (chosen), at 10 Hz.
/// - Dry friction hardly depends on the speed, and wears off rather than hardens.
constexpr Material wood() {
  constexpr double kBall = 0.007;  // [m]
  constexpr double kYield = 0.4 * 20.0 * 4.0 / (std::numbers::pi * square(kBall));
  constexpr double kModulus = kYield * 7.0 / 0.02;
  return {.name = "wood",
          .density = 640.0 * 1.12,
          .elastic_modulus = kModulus,
          .poisson_ratio = 0.37,
          .viscosity = viscosity_of(kModulus, 0.05, 10.0),
          .flow_viscosity = 0.0,
          .yield_stress = kYield,
          .hardening = 0.0};
}

/// Foam around a wire of soft aluminium, 0.15 as thick as the limb (3 mm in 20 mm).
/// - Wire: alloy 1100-O: 2710 kg/m^3, e = 68.9 GPa, nu = 0.33, yield stress 34.5 MPa, strength 89.6 MPa at 35 %
///   elongation, (89.6 - 34.5) / 0.35 = 157 MPa of hardening (Aluminum Association, as on MatWeb).
/// - Foam: 150 kg/m^3, of latex or polyurethane; its modulus, 0.1 MPa, is nothing beside the wire's share.
/// - A section's second moment grows as the fourth power of its size, its modulus I / c as the third. The wire keeps
///   its new shape once all of it yields: at 16 / (3 pi) times the torque at which its surface does (the plastic
///   section modulus of a circle; Gere and Goodno, Mechanics of Materials, 8th ed., sec. 6.10).
/// - A loss factor of 0.02 at 1 Hz, from the strands of a twisted wire on each other (chosen). The yield stress of a
///   metal at room temperature hardly depends on the rate.
constexpr Material wire_armature() {
  constexpr double kThickness = 0.15;
  constexpr double kMomentShare = square(square(kThickness));
  constexpr double kModulus = 68.9e9 * kMomentShare;
  constexpr double kPlastic = 16.0 / (3.0 * std::numbers::pi);
  return {.name = "wire armature",
          .density = 150.0 + (2710.0 - 150.0) * square(kThickness),
          .elastic_modulus = kModulus,
          .poisson_ratio = 0.33,
          .viscosity = viscosity_of(kModulus, 0.02, 1.0),
          .flow_viscosity = 0.0,
          .yield_stress = kPlastic * 34.5e6 * cube(kThickness),
          .hardening = 157e6 * kMomentShare};
}

/// Oil-based modelling clay (plasticine), solid.
/// - Density 1700 kg/m^3: 1500 to 1900 by the filler.
/// - Yield stress 0.1 MPa: cylinders compressed at room temperature flow at 0.1 to 0.2 MPa (Green, Phil. Mag. 42 (1951)
///   365), at hardly more for a larger strain: no hardening. e = 3 MPa: it does so from 3 to 5 % on.
/// - nu = 0.45, nearly incompressible (chosen).
/// - Flow as the seventh power of the stress (Zulauf and Zulauf, J. Struct. Geol. 26 (2004) 725: 5.8 to 8): at a strain
///   rate of 0.1 / s, that of a hand, the slope of the stress is yield_stress / (7 0.1 / s).
/// - A loss factor of 0.3 at 1 Hz (chosen: it hardly springs back).
constexpr Material clay() {
  constexpr double kModulus = 3e6;
  constexpr double kYield = 1e5;
  return {.name = "clay",
          .density = 1700.0,
          .elastic_modulus = kModulus,
          .poisson_ratio = 0.45,
          .viscosity = viscosity_of(kModulus, 0.3, 1.0),
          .flow_viscosity = kYield / (7.0 * 0.1),
          .yield_stress = kYield,
          .hardening = 0.0};
}

constexpr std::array<Material, 4> kMaterials{soft_vinyl(), wood(), wire_armature(), clay()};

}  // namespace

std::span<const Material> materials() { return kMaterials; }

const Material& default_material() { return kMaterials.front(); }

const Material* find_material(std::string_view name) {
  const auto same =
      std::find_if(kMaterials.begin(), kMaterials.end(), [&](const Material& m) { return m.name == name; });
  return same == kMaterials.end() ? nullptr : &*same;
}

}  // namespace layfigure::doll
