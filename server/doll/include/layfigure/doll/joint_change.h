#pragma once

#include <string>
#include <vector>

#include "layfigure/character/rig.h"
#include "layfigure/doll/joint_override.h"
#include "layfigure/dynamics/model.h"

namespace layfigure::doll {

/// The bones that a name or pattern means, as in a settings file: the bone of that very name alone; else all that the
/// pattern matches, in the rig's order. Throws std::invalid_argument, one line with near names, if there is none.
[[nodiscard]] std::vector<int> bones_named(const character::Rig& rig, const std::string& pattern);

/// The joint `now` with what `wish` says of it, as a settings file would have it (settings.h): ratios between axes stay
/// unless single axes are given. Factors are of what the joint was `made` with, so that the same wish twice is the same
/// as once. Of the wish only stiffness, damping, flow damping, yield torque, hardening, limits and locks are looked at;
/// its numbers are not checked: Model does.
[[nodiscard]] dynamics::BodyDefinition changed_joint(JointOverride wish, const dynamics::BodyDefinition& made,
                                                     dynamics::BodyDefinition now);

}  // namespace layfigure::doll
