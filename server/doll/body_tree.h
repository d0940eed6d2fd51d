#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "bone_names.h"
#include "layfigure/character/rig.h"
#include "layfigure/doll/bone_role.h"
#include "surface.h"

namespace layfigure::doll {

/// Which bones are bodies, and what carries the others.
struct BodyTree {
  std::vector<int> bone_of_body;     ///< parents before children
  std::vector<int> parent_of_body;   ///< -1: a root
  std::vector<int> carrier_of_bone;  ///< body, -1: none in the bone's tree
  std::vector<BoneRole> roles;       ///< one per bone
};

/// A choice that cannot be met.
class UnmetChoice : public std::invalid_argument {
 public:
  UnmetChoice(int bone, const std::string& why) : std::invalid_argument(why), bone_(bone) {}
  [[nodiscard]] int bone() const { return bone_; }

 private:
  int bone_;
};

/// By the rules of build_doll(). `owners` are triangle_owners() of the surface; `choices` may be fewer than the bones:
/// the others are automatic. Throws std::invalid_argument: no bone has enough skin; UnmetChoice: a bone that is to be
/// a body has none, or one that is to be merged has no parent.
[[nodiscard]] BodyTree make_body_tree(const std::vector<character::Bone>& bones, const std::vector<BoneName>& names,
                                      const Surface& surface, const std::vector<int>& owners,
                                      const std::vector<MergeChoice>& choices = {});

}  // namespace layfigure::doll
