#pragma once

#include <Eigen/Geometry>
#include <span>
#include <utility>

#include "layfigure/doll/doll.h"
#include "layfigure/haptics/doll_memory.h"

namespace layfigure::session {

/// A body of the doll, not a root, and its rotation R_PB.
using PosedJoint = std::pair<int, Eigen::Quaterniond>;

/// The doll in a pose that it is not driven to but has: these joints have these rotations, others the ones that they
/// have, and all are in equilibrium with gravity. With M the mass of what hangs on a joint, c its com, o the joint, g
/// gravity and K the stiffness, in the axes of the section, the joint's strain is
///     q = K^-1 R_WS^T ((c - o) x M g),   rest rotation = R_PB exp(q)^T
/// and the roots are where their pins (RootPin) hold the weight: lower by M g / k, and turned by the moment about their
/// com over the pin's angular stiffness. Without gravity nothing is strained, and the roots are where they were made.
///
/// Locked axes do not turn: the part of a rotation about them is left out, to first order of what the others turn by.
/// A joint that never yields springs back to its own rest rotation. A pose beyond limits, or of bodies that meet, is
/// taken as it is: the next steps push it out. `doll` has the laws and the gravity that the memory was taken with.
/// Throws std::invalid_argument for a root. O(n), allocates.
[[nodiscard]] haptics::DollMemory posed(const doll::Doll& doll, const haptics::DollMemory& memory,
                                        std::span<const PosedJoint> joints);

}  // namespace layfigure::session
