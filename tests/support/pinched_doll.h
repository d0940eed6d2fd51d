#pragma once

#include "layfigure/doll/doll.h"

namespace layfigure::testing {

/// Radius of the limb that pinched_limb() is [m].
constexpr double kLimbRadius = 0.03;
constexpr double kLimbMass = 0.3;  // [kg]

/// A doll of one free body, a capsule along x whose middle is at (0, 0, 1) m: a forearm that nothing but hands holds.
/// Its com is `off_center` [m] along x from there.
[[nodiscard]] doll::Doll pinched_limb(double off_center = 0.0);

/// The small doll with limbs as thick as arms.
[[nodiscard]] doll::Doll thick_doll();

}  // namespace layfigure::testing
