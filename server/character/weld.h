#pragma once

#include "layfigure/character/rig.h"

namespace layfigure::character {

/// Joins vertices that have the same position and the same influences, bit for bit, and drops the triangles that this
/// leaves without area. Before, the mesh has a wedge for each vertex, if it has any, and no Wedges::triangles; after,
/// it has those wedges that differ. Their numbers are finite. O(n).
void weld(SkinnedMesh& mesh);

}  // namespace layfigure::character
