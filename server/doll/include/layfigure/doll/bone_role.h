#pragma once

#include <string_view>

namespace layfigure::doll {

/// What is asked for a bone, in place of the rules of build_doll().
enum class MergeChoice {
  kAutomatic,  ///< by the rules
  kBody,       ///< a body of its own, however small its skin is
  kMerge,      ///< its skin belongs to its parent's body
};

/// Why a bone is a body, or moves with another one's.
enum class BoneReason {
  kOwnSkin,      ///< a body: it has enough skin
  kBodyChosen,   ///< a body: MergeChoice::kBody
  kMergeChosen,  ///< merged: MergeChoice::kMerge
  kTwistHelper,  ///< merged: it spreads the twist of a limb
  kSegment,      ///< merged: a further bone of an undivided limb, a metacarpal of the hand, a half of the hips
  kFace,         ///< merged: part of a face
  kTooSmall,     ///< merged: too little skin, mass or length to matter
  kControl,      ///< rides: a control, which moves other bones and no skin
  kNoSkin,       ///< rides: no skin weighs most upon it
};

/// What became of a bone of the rig.
struct BoneRole {
  BoneReason reason{BoneReason::kNoSkin};

  [[nodiscard]] bool is_body() const { return reason == BoneReason::kOwnSkin || reason == BoneReason::kBodyChosen; }
};

/// For reports: "twist helper".
[[nodiscard]] std::string_view reason_text(BoneReason reason);

}  // namespace layfigure::doll
