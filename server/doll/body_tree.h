#pragma once

#include <vector>

#include "layfigure/character/rig.h"
#include "surface.h"

namespace layfigure::doll {

/// Which bones are bodies, and what carries the others.
struct BodyTree {
  std::vector<int> bone_of_body;     ///< parents before children
  std::vector<int> parent_of_body;   ///< -1: a root
  std::vector<int> carrier_of_bone;  ///< body, -1: none in the bone's tree
};

/// By the rules of build_doll(). `owners` are triangle_owners() of the surface. Throws std::invalid_argument if no bone
/// has enough skin.
[[nodiscard]] BodyTree make_body_tree(const std::vector<character::Bone>& bones, const Surface& surface,
                                      const std::vector<int>& owners);

}  // namespace layfigure::doll
