#pragma once

#include "layfigure/doll/doll.h"
#include "layfigure/haptics/doll_memory.h"

namespace layfigure::session {

enum class MirrorSide {
  kBoth,   ///< left and right change places
  kLeft,   ///< the left side's pose goes onto the right
  kRight,  ///< the right side's onto the left
};

/// The doll's pose in the mirror of its bind pose's plane (Doll::mirror_normal): rotations, rest rotations and flow;
/// all else stays. A body b takes on what its image m does. With R0 the rotations of the bind pose, p and pm the
/// parents of b and m, and S the reflection in the plane,
///     R_pb = R0_p^T S (R0_pm R_pm,m R0_m^T) S R0_b
/// so that the bones' own axes need not be each other's images. Joints that are locked about all axes stay as they are;
/// bodies in the middle, and the root, change with kBoth alone.
/// Throws std::invalid_argument if the doll has no two bodies that are each other's images. O(n).
[[nodiscard]] haptics::DollMemory mirrored(const doll::Doll& doll, const haptics::DollMemory& memory, MirrorSide side);

}  // namespace layfigure::session
