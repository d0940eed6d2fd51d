#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "layfigure/character/rig.h"

namespace layfigure::character {

/// What turns the normals of a surface whose points are mapped by `linear`: its cofactors with the sign of its
/// determinant, a multiple of its inverse transposed wherever that exists. Lengths change.
[[nodiscard]] Eigen::Matrix3d normal_map(const Eigen::Matrix3d& linear);

/// Makes a unit vector of a normal that a file gives; zero if it has no direction.
[[nodiscard]] Eigen::Vector3f unit_or_zero(const Eigen::Vector3d& normal);

/// Gives the mesh's zero normals those of its vertices, the mean of their triangles' weighted by area, and tells it in
/// `warnings`; up, where a vertex has no triangle.
void mend_normals(SkinnedMesh& mesh, std::vector<std::string>& warnings);

/// Twice the area, summed over the corners of all triangles, as their normals see it: negative if they point against
/// the sides from which the triangles are counter-clockwise. 0 without normals.
[[nodiscard]] double facing_area(const SkinnedMesh& mesh);

}  // namespace layfigure::character
