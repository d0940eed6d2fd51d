#pragma once

#include "body_layout.h"
#include "layfigure/dynamics/limits.h"

namespace layfigure::doll {

/// The limits that the character's file states for the joint of `body` (body.stated), whose limb points along `limb`
/// (unit, world), as a twist and a swing. The twist is about the one of the file's axes that is nearest to the limb,
/// swing y and z about the two that follow it. They are measured from the file's reference or, about an axis whose
/// bounds exclude it, from the middle of these, or from the only bound. About one axis at a time they allow just what
/// the file does; about several at once, the file's angles make a box, and the swing's bounds an ellipse in it. A bound
/// nearer than kLeastRangeDeg (range_of_motion.h) is set to that, one beyond half a turn is none.
[[nodiscard]] dynamics::JointLimits stated_limits(const BodyPlace& body, const Eigen::Vector3d& limb);

}  // namespace layfigure::doll
