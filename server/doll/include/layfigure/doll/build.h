#pragma once

#include "layfigure/character/rig.h"
#include "layfigure/doll/doll.h"
#include "layfigure/doll/settings.h"

namespace layfigure::doll {

/// Makes a doll of a rig.
///
/// Bodies. Each triangle belongs to the bone that weighs most on its corners. By the bones' names (bone_names.h) the
/// skin of some goes to another one above them:
/// - a twist or roll helper's to the limb that it is called after, or that it hangs on beside it,
/// - that of a further bone of an undivided limb (upperarm02, upper_arm.L.001), if it lies in line with the first and
///   the next limb follows it, to the bone above; a metacarpal's to the hand; a half of the hips' to what it hangs on,
/// - that of eyes, lids, brows, lips, cheeks, nose, tongue and teeth to the head, or to the jaw if they hang on it; a
///   jaw is a bone like others.
/// So a bone is carried by its own body or as its parent is, and its distance from its parent never changes.
/// A bone that then has at least 4 triangles, 1e-4 of the skin's area, 1e-5 of its volume and reaches 0.5 % of the
/// character's largest extent from its joint is a body. A smaller one is merged into its parent, from the tips inwards.
/// Bones without skin (IK, poles, controls, ends) ride on the nearest body above, and those above every body on the one
/// with the most skin, to which the other limbs are then joined too. `merge` in the settings of a joint overrules
/// all this. Doll::bone_roles tells what became of each. A body's frame is its bone's.
///
/// Mirror. Doll::mirror_of_body pairs the bodies of both sides, by their names where they say a side and by their
/// places in the bind pose.
///
/// Limits. A joint has the limits that the character's file states for its bone, if it does (an FBX can). Else it has
/// the range of motion of what its bone is called, about axes that follow from where the joints
/// of the bind pose are and where the feet point, not from the axes of the bones; mirrored pairs have mirrored limits.
/// Bones of unknown parts turn by 120 degrees and twist by 90. A rest pose beyond its limits widens them, which is
/// reported.
///
/// Mass. A body's part of the skin is closed, each open loop by a fan to its centroid, and volume, com and inertia are
/// integrated over it (divergence theorem), times the density. A part that encloses hardly anything counts as the
/// capsule in its bounding box along the bone's axes, which is reported.
///
/// Joints. The skin that the body weighs upon is cut by the plane through the joint across the direction from the joint
/// to the body's com; Green's theorem over the loop about the joint, less the holes in it, gives the area, the
/// principal axes of bending y and z, their second moments of area I_y and I_z, J = I_y + I_z of twist, and the largest
/// distances c from the centroid and from the two axes. With s the distance of the two bodies' coms, each axis has its
/// own law (physics: Matsunaga, Eq. 3-4), for which I stands for J / (2 (1 + nu)), I_y, I_z:
///     K_f = elastic_modulus I / s,   D_f = viscosity I / s,   D_d = flow_viscosity I / s,   H = hardening I / s,
///     t_y = yield_stress (J / (sqrt(3) c_x), I_y / c_y, I_z / c_z)
/// (section_law.h derives them). The joint's K_f, D_f and t_y are those of its weakest axis, its shape gives the others
/// as multiples. Where no loop is found, the section is the circle that the body's volume and length suggest, which is
/// reported.
///
/// Calibration. The fourth power of the thickness leaves thin limbs too weak, so each is a minimum, about every axis:
///     t_y >= hold_margin W,               K_f >= W / largest_sag,  K_f >= t_y / largest_strain,
///     D_f >= 2 damping_ratio sqrt(K_f M), D_d >= 2 t_y / largest_flow_rate
/// where W is the torque of the weight of all that hangs on the joint, were it stretched out level, and M its largest
/// moment of inertia about the joint in the rest pose: the weakest axis holds the limb in any pose, whichever way is
/// down. Joints whose K_f or t_y it raised are reported.
///
/// The root is pinned with a natural frequency of 10 Hz, critically damped, by the mass and inertia of the whole.
///
/// Settings of single joints come last: they hold whatever was chosen or raised, and keep the ratios of the axes. Which
/// bones are merged comes first, and densities and masses before the joints, so that all else follows from the weights
/// that the doll will have.
///
/// Throws std::invalid_argument: settings out of range, or no bone has enough skin. Throws SettingsError: settings of
/// joints that the character has not, or a merge that cannot be: a body without skin, a merged bone without parent.
/// O(triangles + bones^2). Thread-safe.
[[nodiscard]] Doll build_doll(character::Rig rig, const DollSettings& settings = {});

}  // namespace layfigure::doll
