#pragma once

#include "layfigure/character/rig.h"
#include "source_scene.h"

namespace layfigure::character {

/// Gives the rig those materials of the scene that its meshes have, and their pictures; the meshes' and materials'
/// indices, which are the scene's before, are the rig's after.
void add_looks(const SourceScene& scene, Rig& rig);

}  // namespace layfigure::character
