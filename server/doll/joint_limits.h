#pragma once

#include <string>
#include <vector>

#include "body_layout.h"
#include "layfigure/doll/doll.h"
#include "layfigure/dynamics/limits.h"
#include "mirror.h"

namespace layfigure::doll {

/// The limits of every body's joint, none for roots: those that the character's file states (stated_limits.h; of the
/// formats that are read, FBX alone has some for a skeleton's joints), else the range of motion of its part
/// (range_of_motion.h) about the axes that the character's build gives it (joint_axes.h), as a swing about y and z and
/// a twist about x. Bones whose part or axes are not known turn 120 degrees every way from the rest pose and twist
/// by 90.
///
/// The two joints of a mirrored pair have limits that are each other's images exactly, unless the file states some. The
/// rest pose is inside all of them by kLeastRangeDeg at least: a limit that it is beyond is widened, both of a pair
/// alike, and reported.
///
/// O(bodies^2).
[[nodiscard]] std::vector<dynamics::JointLimits> make_joint_limits(const BodyLayout& layout, const Mirror& mirror,
                                                                   std::vector<std::string>& warnings);

/// Where the range of each body's joint comes from, such as "anatomical range of the upper arm".
[[nodiscard]] std::vector<Reason> limit_reasons(const BodyLayout& layout, const Mirror& mirror);

/// The limits of the joint of `other`, the mirror image of those of `body`'s. A rotation vector w becomes -S w: in the
/// axes S x, -S y, S z, which are right-handed, twists and swings about z change their sign.
[[nodiscard]] dynamics::JointLimits mirrored_limits(const dynamics::JointLimits& limits, const BodyLayout& layout,
                                                    const Mirror& mirror, int body, int other);

}  // namespace layfigure::doll
