#pragma once

#include <Eigen/Core>
#include <vector>

#include "layfigure/character/rig.h"

namespace layfigure::doll {

/// All meshes of a rig as one skin in the bind pose, world axes; vertices of equal position joined. A triangle that is
/// there twice, as the back of the other or on top of it, is there once.
struct Surface {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<std::vector<character::Influence>> influences;  ///< by bone, later by body; one list per vertex
};

[[nodiscard]] Surface make_surface(const character::Rig& rig);

/// Renames the owners of the influences, from bones to the bodies that carry them, and adds up those that become one.
/// Influences of owners that have no new name (-1) are dropped.
void rename_owners(Surface& surface, const std::vector<int>& new_owner);

/// The owner that weighs most on each triangle's corners, the lower index of equals; -1 if nothing does.
[[nodiscard]] std::vector<int> triangle_owners(const Surface& surface);

/// Weight of `owner` on a vertex, 0 if none.
[[nodiscard]] double weight_of(const Surface& surface, int vertex, int owner);

[[nodiscard]] double triangle_area(const Surface& surface, const Eigen::Vector3i& triangle);

}  // namespace layfigure::doll
