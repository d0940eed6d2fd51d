#pragma once

#include <optional>
#include <vector>

#include "bone_names.h"
#include "layfigure/character/rig.h"
#include "layfigure/doll/bone_role.h"

namespace layfigure::doll {

/// Where a bone's skin goes by its name.
struct Merge {
  int host{-1};  ///< an ancestor or a sibling, which is not merged into its own sibling
  BoneReason reason{BoneReason::kNoSkin};
};

/// The rules of build_doll() that go by names: twist helpers, segments, faces. None: the bone stays by itself.
[[nodiscard]] std::vector<std::optional<Merge>> merges_by_name(const std::vector<character::Bone>& bones,
                                                               const std::vector<BoneName>& names);

}  // namespace layfigure::doll
