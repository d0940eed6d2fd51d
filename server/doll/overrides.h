#pragma once

#include <string>
#include <vector>

#include "layfigure/character/rig.h"
#include "layfigure/doll/bone_role.h"
#include "layfigure/doll/doll.h"
#include "layfigure/doll/settings.h"

namespace layfigure::doll {

/// What the settings say of each bone, put together: of tables that name one value twice, a bone's own name wins over
/// patterns and the later pattern over the earlier. `pattern` is then the bone's name. One per bone.
/// Throws SettingsError: a pattern that matches no bone, with names that may have been meant.
[[nodiscard]] std::vector<JointOverride> resolve_overrides(const DollSettings& settings,
                                                           const std::vector<character::Bone>& bones);

/// One per bone.
[[nodiscard]] std::vector<MergeChoice> merge_choices(const std::vector<JointOverride>& of_bone);

/// Throws SettingsError: why `merge` of that bone cannot be met, and where it is asked for.
[[noreturn]] void refuse_merge(const JointOverride& of_bone, const DollSettings& settings, const std::string& why);

/// Fills doll.matter's densities from the volumes [m^3] of the bodies, so that with doll.settings.total_mass the whole
/// doll weighs that; bodies whose own mass is given keep it. Needs doll.bone_of_body and doll.settings.
/// Throws SettingsError: masses that the total leaves no room for, densities out of range.
void choose_densities(const std::vector<JointOverride>& of_bone, const std::vector<double>& volumes, Doll& doll);

/// Gives joints and bodies what the settings say of them, after calibrate() chose. Laws keep the ratios of their axes
/// unless values of single axes are given; limits are measured in the axes and from the pose of those that the doll has
/// chosen for the joint. Throws SettingsError: limits that exclude the rest pose; values for joints or bodies, all of
/// whose bones have none.
void apply_overrides(const std::vector<JointOverride>& of_bone, Doll& doll);

/// What of the above is about one joint, without any check.
void apply_to_joint(const JointOverride& joint, dynamics::BodyDefinition& body, Reasons& reasons);

}  // namespace layfigure::doll
