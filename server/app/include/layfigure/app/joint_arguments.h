#pragma once

#include <string_view>
#include <vector>

#include "layfigure/app/arguments.h"
#include "layfigure/doll/joint_override.h"

namespace layfigure::app {

/// The arguments that say what a joint is to be, called as in a settings file (doll/settings.h) but in SI:
///     stiffness x, stiffness.factor f, stiffness.twist x, stiffness.bend_y.factor f, ...; damping, yield_torque
///     likewise flow_damping x, flow_damping.factor f; hardening likewise limits.twist lower upper [rad],
///     limits.swing_y, limits.swing_z
/// Texts that outlive everything.
[[nodiscard]] const std::vector<std::string_view>& joint_argument_names();

/// What they say; nothing if none is there. Throws Refusal: one is out of its range, or contradicts another.
[[nodiscard]] std::optional<doll::JointOverride> joint_arguments(const Arguments& arguments);

}  // namespace layfigure::app
