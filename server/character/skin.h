#pragma once

#include <string>
#include <vector>

#include "layfigure/character/rig.h"
#include "skeleton.h"
#include "source_scene.h"

namespace layfigure::character {

/// The meshes in the world, with normalised weights, joined vertices and no degenerate triangles.
[[nodiscard]] std::vector<SkinnedMesh> make_meshes(const SourceScene& scene, const Skeleton& skeleton,
                                                   std::vector<std::string>& warnings);

/// Six times the signed volume, summed over the triangles about `reference`: positive if they face outwards.
[[nodiscard]] double signed_volume6(const SkinnedMesh& mesh, const Eigen::Vector3d& reference);

}  // namespace layfigure::character
