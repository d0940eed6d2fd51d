#include "layfigure/doll/bone_role.h"

namespace layfigure::doll {

std::string_view reason_text(BoneReason reason) {
  switch (reason) {
    case BoneReason::kOwnSkin:
      return "own skin";
    case BoneReason::kBodyChosen:
      return "chosen as a body";
    case BoneReason::kMergeChosen:
      return "chosen to be merged";
    case BoneReason::kTwistHelper:
      return "twist helper";
    case BoneReason::kSegment:
      return "segment of its limb";
    case BoneReason::kFace:
      return "part of the face";
    case BoneReason::kTooSmall:
      return "too small";
    case BoneReason::kControl:
      return "control without skin";
    case BoneReason::kNoSkin:
      return "no skin";
  }
  return "";
}

}  // namespace layfigure::doll
