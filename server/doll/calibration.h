#pragma once

#include <string>
#include <vector>

#include "layfigure/doll/doll.h"
#include "layfigure/doll/settings.h"

namespace layfigure::doll {

/// What hangs on a body's joint, the body included.
struct LimbLoad {
  double weight_torque{0.0};  ///< W, of its weight, were it stretched out level [N m]
  double inertia{0.0};        ///< M, largest moment about the joint in the rest pose [kg m^2]
};

/// One per body. O(n).
[[nodiscard]] std::vector<LimbLoad> limb_loads(const dynamics::ModelDefinition& definition);

/// Gives the joints of all bodies but the roots their laws, from doll.sections and the minima of build_doll(), and the
/// root its pin. Notes why in doll.reasons, which has one per body.
void calibrate(Doll& doll, const DollSettings& settings);

/// Adds to the doll's warnings the joints whose stiffness or yield torque calibrate() raised, and which are still so.
void report_raised(Doll& doll);

}  // namespace layfigure::doll
