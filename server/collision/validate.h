#pragma once

#include "layfigure/collision/world.h"

namespace layfigure::collision {

/// Throws std::invalid_argument that names what is wrong in the definition, its value and the allowed range.
void validate(const WorldDefinition& definition);

/// True if every number is finite and the quaternion unit to 1e-6, as a step leaves it many times over.
[[nodiscard]] bool is_rigid(const Pose& pose);

}  // namespace layfigure::collision
