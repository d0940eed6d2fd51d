#pragma once

#include <string>
#include <vector>

namespace layfigure::doll {

/// Where a bone is in a body of two arms and two legs. A bone is called after what it moves: the forearm's turns about
/// the elbow.
enum class BonePart {
  kUnknown,
  kHips,
  kSpine,
  kChest,
  kNeck,
  kHead,
  kJaw,
  kEye,
  kFace,  ///< lids, brows, lips, cheeks, nose, tongue, teeth
  kClavicle,
  kUpperArm,
  kForearm,
  kHand,
  kMetacarpal,  ///< of the palm; the thumb's is kThumb, 1
  kThumb,
  kIndex,
  kMiddle,
  kRing,
  kLittle,
  kThigh,
  kShin,
  kFoot,
  kToes,
};

enum class BodySide { kNone, kLeft, kRight };

/// What a bone is for.
enum class BoneUse {
  kLimb,     ///< moves skin
  kTwist,    ///< helps to: spreads the twist of a limb, fills a bent joint
  kControl,  ///< IK, pole, target: moves other bones
  kEnd,      ///< marks where the last bone of a chain ends
};

/// What a bone's name says about it.
struct BoneName {
  BonePart part{BonePart::kUnknown};
  BodySide side{BodySide::kNone};
  BoneUse use{BoneUse::kLimb};
  int segment{0};    ///< of a finger: 1 next to the hand, to 3; 0: no finger
  std::string stem;  ///< the name without its side, in lower case: the same for left and right
};

/// Reads the names of all bones of a rig. Known are the conventions of Mixamo, MakeHuman, Rigify, VRM and VRoid, SMPL,
/// 3ds Max's Biped, Unreal's mannequin, Character Creator, Daz and of motion capture files.
///
/// A name is split into words at case, digits and punctuation; prefixes (mixamorig:, Bip01, DEF-, J_Bip_) and sides are
/// taken away; what is left must be a word of the table as a whole, so that "armor" is no arm. All bones are read
/// together, since some words mean different bones beside others: where there are elbows and no arms, bones are called
/// after their joints, and the shoulder's is the upper arm. O(total length x table).
[[nodiscard]] std::vector<BoneName> read_bone_names(const std::vector<std::string>& names);

/// One of the five fingers.
[[nodiscard]] bool is_finger(BonePart part);

/// For reports: "upper arm".
[[nodiscard]] const char* part_text(BonePart part);

}  // namespace layfigure::doll
