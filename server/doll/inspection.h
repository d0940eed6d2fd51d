#pragma once

#include <string>

#include "layfigure/doll/doll.h"

namespace layfigure::doll {

/// [kg]
[[nodiscard]] double total_mass(const Doll& doll);

/// The character's content hash, 16 digits.
[[nodiscard]] std::string hash_text(const Doll& doll);

/// The bounds of a joint about one axis of its limits [rad]; infinite where it has none.
[[nodiscard]] AngleRange twist_range(const dynamics::JointLimits& limits);
[[nodiscard]] AngleRange swing_range(const dynamics::JointLimits& limits, int axis);

}  // namespace layfigure::doll
