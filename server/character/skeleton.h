#pragma once

#include <string>
#include <vector>

#include "layfigure/character/rig.h"
#include "source_scene.h"

namespace layfigure::character {

/// The bones of a scene, and which node became which bone.
struct Skeleton {
  std::vector<Bone> bones;                  ///< in the world; one root
  std::vector<int> bone_of_node;            ///< nearest bone at or above the node; -1: none
  std::vector<Eigen::Affine3d> mesh_poses;  ///< per mesh: mesh -> world in the bind pose
  std::vector<std::string> warnings;
};

/// Chooses the bones and gives them bind and rest poses by the rules of import_rig(). Throws std::runtime_error, saying
/// what is wrong and the mend, if no mesh is skinned or a bind matrix cannot be inverted.
[[nodiscard]] Skeleton make_skeleton(const SourceScene& scene);

}  // namespace layfigure::character
