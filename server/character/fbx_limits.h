#pragma once

#include <assimp/scene.h>

#include <optional>
#include <string>
#include <vector>

#include "layfigure/character/rig.h"

namespace layfigure::character {

/// The limits that an FBX file gives a node, from the properties of it that assimp keeps as metadata. FBX composes
///     R_PB = R_pre R(x, y, z) R_post^-1
/// with Euler angles x, y, z [deg], which RotationMin and RotationMax bound: x where RotationMinX is set and so on, all
/// if RotationActive is (Autodesk, FBX SDK, FbxNode: "Rotation and scaling pivots", FbxLimits). assimp makes nodes of
/// R_pre and R_post^-1 above this one where they are not the identity (AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS). So
///     R_BJ = R_post,   reference = R_pre R_post^-1 .
/// Which order the angles are composed in is not passed on; at the reference, and along each axis from there, all
/// orders agree.
///
/// None: the file bounds no angle. A bound that is not finite, or a lower one above the upper one, is left out and told
/// in `warnings`, under the node's name.
[[nodiscard]] std::optional<BoneLimits> fbx_limits(const aiNode& node, const std::string& name,
                                                   std::vector<std::string>& warnings);

}  // namespace layfigure::character
