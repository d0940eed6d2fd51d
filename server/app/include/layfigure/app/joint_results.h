#pragma once

#include <layfigure/reply_t.hpp>
#include <vector>

#include "layfigure/doll/doll.h"

namespace layfigure::app {

/// Adds to a reply what these joints are, joint by joint under each name, as a settings file calls it. SI, infinities
/// where there is no bound.
///
///     stiffness, damping, yield_torque              of the unit axis
///     stiffness.ratios, damping.ratios, ...         3: multiples of it, of twist, bend_y, bend_z
///     flow_damping, hardening
///     limits.twist, limits.swing_y, limits.swing_z  2: lower, upper [rad]
///     locked                                        3: 1 or 0, of twist, bend_y, bend_z
///     section_axes, limit_axes                      4: w x y z, R_BS of twist, bend_y, bend_z in the bone's frame, and
///                                                   R_BL of the limits' axes
void add_joints(reply_t& reply, const std::vector<doll::JointChoice>& joints);

}  // namespace layfigure::app
