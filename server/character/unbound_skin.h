#pragma once

#include "source_scene.h"

namespace layfigure::character {

/// Binds the meshes whose joints all have the identity as their bind matrix, as a glTF without inverseBindMatrices has
/// it: their vertices are given in the joints' own frames, so that there is no pose in which the mesh is undeformed.
/// They are bound as the file poses them,
///     v = sum_j w_j X_FJ v_j,   offset_j = X_FJ^-1
/// with X_FJ the pose of joint j's node, which is what viewers show. Told in the scene's warnings. A mesh of one joint
/// needs nothing.
void bind_unbound_skins(SourceScene& scene);

}  // namespace layfigure::character
