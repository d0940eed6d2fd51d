#pragma once

#include <string_view>

#include "bone_names.h"

// The words of bones' names, in lower case.
namespace layfigure::doll {

/// What a word of a bone's name means.
struct Row {
  std::string_view word;
  BonePart part;
};

/// Of what is left of a name, its words joined.
inline constexpr Row kParts[] = {
    {"hips", BonePart::kHips},
    {"hip", BonePart::kHips},
    {"pelvis", BonePart::kHips},
    {"hipjoint", BonePart::kHips},
    {"spine", BonePart::kSpine},
    {"lowerspine", BonePart::kSpine},
    {"upperspine", BonePart::kSpine},
    {"spinelower", BonePart::kSpine},
    {"spinemiddle", BonePart::kSpine},
    {"spineupper", BonePart::kSpine},
    {"lowerback", BonePart::kSpine},
    {"abdomen", BonePart::kSpine},
    {"abdomenlower", BonePart::kSpine},
    {"abdomenupper", BonePart::kSpine},
    {"torso", BonePart::kSpine},
    {"waist", BonePart::kSpine},
    {"chest", BonePart::kChest},
    {"upperchest", BonePart::kChest},
    {"chestlower", BonePart::kChest},
    {"chestupper", BonePart::kChest},
    {"thorax", BonePart::kChest},
    {"ribcage", BonePart::kChest},
    {"neck", BonePart::kNeck},
    {"necklower", BonePart::kNeck},
    {"neckupper", BonePart::kNeck},
    {"head", BonePart::kHead},
    {"headtop", BonePart::kHead},
    {"jaw", BonePart::kJaw},
    {"jawmaster", BonePart::kJaw},
    {"jawroot", BonePart::kJaw},
    {"lowerjaw", BonePart::kJaw},
    {"eye", BonePart::kEye},
    {"eyeball", BonePart::kEye},
    {"faceeye", BonePart::kEye},
    {"eyesmplhf", BonePart::kEye},
    {"clavicle", BonePart::kClavicle},
    {"collar", BonePart::kClavicle},
    {"collarbone", BonePart::kClavicle},
    {"scapula", BonePart::kClavicle},
    {"shoulder", BonePart::kClavicle},
    {"arm", BonePart::kUpperArm},
    {"upperarm", BonePart::kUpperArm},
    {"uparm", BonePart::kUpperArm},
    {"shldr", BonePart::kUpperArm},
    {"shldrbend", BonePart::kUpperArm},
    {"forearm", BonePart::kForearm},
    {"lowerarm", BonePart::kForearm},
    {"lowarm", BonePart::kForearm},
    {"fore", BonePart::kForearm},  // Biped's "L ForeTwist"
    {"forearmbend", BonePart::kForearm},
    {"elbow", BonePart::kForearm},
    {"hand", BonePart::kHand},
    {"wrist", BonePart::kHand},
    {"metacarpal", BonePart::kMetacarpal},
    {"carpal", BonePart::kMetacarpal},
    {"palm", BonePart::kMetacarpal},
    {"fingerbase", BonePart::kMetacarpal},
    {"thigh", BonePart::kThigh},
    {"thighbend", BonePart::kThigh},
    {"upleg", BonePart::kThigh},
    {"upperleg", BonePart::kThigh},
    {"leg", BonePart::kShin},
    {"lowerleg", BonePart::kShin},
    {"lowleg", BonePart::kShin},
    {"shin", BonePart::kShin},
    {"calf", BonePart::kShin},
    {"knee", BonePart::kShin},
    {"foot", BonePart::kFoot},
    {"ankle", BonePart::kFoot},
    {"toe", BonePart::kToes},
    {"toes", BonePart::kToes},
    {"toebase", BonePart::kToes},
    {"ball", BonePart::kToes},
    {"bigtoe", BonePart::kToes},
    {"smalltoe", BonePart::kToes},
};

inline constexpr Row kFingers[] = {
    {"thumb", BonePart::kThumb},  {"index", BonePart::kIndex},   {"middle", BonePart::kMiddle},
    {"mid", BonePart::kMiddle},   {"ring", BonePart::kRing},     {"little", BonePart::kLittle},
    {"pinky", BonePart::kLittle}, {"pinkie", BonePart::kLittle},
};

/// Of fingers that are counted from the thumb.
inline constexpr BonePart kCountedFingers[] = {BonePart::kThumb, BonePart::kIndex, BonePart::kMiddle, BonePart::kRing,
                                               BonePart::kLittle};

inline constexpr std::string_view kFingerFillers[] = {"hand", "finger", "f", "in"};

/// One of them is enough: face rigs have hundreds of names.
inline constexpr std::string_view kFaceWords[] = {
    "face",     "lid",  "lids",    "eyelid",  "brow",        "brows",    "eyebrow",    "lip",     "lips",
    "cheek",    "nose", "nostril", "tongue",  "teeth",       "tooth",    "mouth",      "chin",    "temple",
    "forehead", "oris", "oculi",   "levator", "orbicularis", "risorius", "temporalis", "special", "facial"};

inline constexpr std::string_view kControlWords[] = {"ik",  "fk",     "pole",   "ctrl", "control", "controller",
                                                     "mch", "target", "widget", "goal", "tweak"};
inline constexpr std::string_view kTwistWords[] = {"twist", "roll", "helper", "share"};
inline constexpr std::string_view kEndWords[] = {"end", "nub", "tip"};
inline constexpr std::string_view kPrefixes[] = {"mixamorig", "bip",        "biped", "valve",   "def",
                                                 "org",       "normalized", "cc",    "base",    "j",
                                                 "adj",       "character",  "rig",   "armature"};
/// Said of a bone of any part.
inline constexpr std::string_view kFillers[] = {"bone", "bn", "jnt", "joint", "jt", "bind"};

}  // namespace layfigure::doll
