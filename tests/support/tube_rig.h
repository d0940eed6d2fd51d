#pragma once

#include "layfigure/character/rig.h"

namespace layfigure::testing {

/// A closed tube about the z axis from z = 0 upwards, made of one bone after the other.
struct Tube {
  int bones{3};
  double bone_length{0.2};  ///< [m]
  int rings_per_bone{8};
  int sides{12};
  double radius{0.05};  ///< of a ring's corners [m]
};

/// Bones bone0, bone1, .., each bound in axes of its own; one mesh. A vertex weighs upon the bones within 1.75 bone
/// lengths of it, less the farther their middles are: up to four bones.
[[nodiscard]] character::Rig tube_rig(const Tube& tube);

/// Vertex `corner` of ring `ring`.
[[nodiscard]] inline int tube_vertex(const Tube& tube, int ring, int corner) { return ring * tube.sides + corner; }

/// Rings of a tube.
[[nodiscard]] inline int tube_rings(const Tube& tube) { return tube.bones * tube.rings_per_bone + 1; }

}  // namespace layfigure::testing
