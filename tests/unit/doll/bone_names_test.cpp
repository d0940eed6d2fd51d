#include "bone_names.h"

#include <gtest/gtest.h>

#include <set>

namespace layfigure::doll {
namespace {

using enum BonePart;
using enum BodySide;

struct Expected {
  const char* name;
  BonePart part;
  BodySide side{kNone};
  int segment{0};
  BoneUse use{BoneUse::kLimb};
};

void expect_rig(const std::vector<Expected>& bones) {
  std::vector<std::string> names;
  for (const Expected& bone : bones) names.emplace_back(bone.name);
  const std::vector<BoneName> read = read_bone_names(names);
  ASSERT_EQ(read.size(), bones.size());
  for (std::size_t b = 0; b < bones.size(); ++b) {
    EXPECT_STREQ(part_text(read[b].part), part_text(bones[b].part)) << bones[b].name;
    EXPECT_EQ(read[b].side, bones[b].side) << bones[b].name;
    EXPECT_EQ(read[b].segment, bones[b].segment) << bones[b].name;
    EXPECT_EQ(read[b].use, bones[b].use) << bones[b].name;
  }
}

TEST(BoneNames, Mixamo) {
  expect_rig({{"mixamorig:Hips", kHips},
              {"mixamorig:Spine", kSpine},
              {"mixamorig:Spine1", kSpine},
              {"mixamorig:Spine2", kSpine},
              {"mixamorig:Neck", kNeck},
              {"mixamorig:Head", kHead},
              {"mixamorig:HeadTop_End", kHead, kNone, 0, BoneUse::kEnd},
              {"mixamorig:LeftEye", kEye, kLeft},
              {"mixamorig:LeftShoulder", kClavicle, kLeft},
              {"mixamorig:LeftArm", kUpperArm, kLeft},
              {"mixamorig:LeftForeArm", kForearm, kLeft},
              {"mixamorig:LeftHand", kHand, kLeft},
              {"mixamorig:LeftHandThumb1", kThumb, kLeft, 1},
              {"mixamorig:LeftHandThumb4", kThumb, kLeft, 3, BoneUse::kEnd},
              {"mixamorig:LeftHandIndex2", kIndex, kLeft, 2},
              {"mixamorig:LeftHandMiddle3", kMiddle, kLeft, 3},
              {"mixamorig:LeftHandRing1", kRing, kLeft, 1},
              {"mixamorig:RightHandPinky1", kLittle, kRight, 1},
              {"mixamorig:RightUpLeg", kThigh, kRight},
              {"mixamorig:RightLeg", kShin, kRight},
              {"mixamorig:RightFoot", kFoot, kRight},
              {"mixamorig:RightToeBase", kToes, kRight},
              {"mixamorig:RightToe_End", kToes, kRight, 0, BoneUse::kEnd}});
  // As three.js and importers that forbid colons spell them.
  expect_rig({{"mixamorigLeftForeArm", kForearm, kLeft},
              {"mixamorig5:RightHandIndex1", kIndex, kRight, 1},
              {"mixamorig_LeftUpLeg", kThigh, kLeft},
              {"Armature|mixamorig:Spine2", kSpine}});
}

TEST(BoneNames, MakeHumanDefaultRig) {
  expect_rig({{"root", kUnknown},
              {"pelvis.L", kHips, kLeft},
              {"spine05", kSpine},
              {"spine01", kSpine},
              {"neck02", kNeck},
              {"head", kHead},
              {"jaw", kJaw},
              {"eye.R", kEye, kRight},
              {"tongue00", kFace},
              {"tongue05.L", kFace, kLeft},
              {"levator02.L", kFace, kLeft},
              {"oris04.R", kFace, kRight},
              {"orbicularis03.L", kFace, kLeft},
              {"special05.R", kFace, kRight},
              {"temporalis01.L", kFace, kLeft},
              {"breast.L", kUnknown, kLeft},
              {"clavicle.L", kClavicle, kLeft},
              {"shoulder01.L", kClavicle, kLeft},
              {"upperarm01.L", kUpperArm, kLeft},
              {"upperarm02.L", kUpperArm, kLeft},
              {"lowerarm02.R", kForearm, kRight},
              {"wrist.R", kHand, kRight},
              {"metacarpal1.R", kMetacarpal, kRight},
              {"finger1-1.R", kThumb, kRight, 1},
              {"finger2-3.R", kIndex, kRight, 3},
              {"finger3-2.L", kMiddle, kLeft, 2},
              {"finger4-1.L", kRing, kLeft, 1},
              {"finger5-3.L", kLittle, kLeft, 3},
              {"upperleg01.L", kThigh, kLeft},
              {"lowerleg02.L", kShin, kLeft},
              {"foot.L", kFoot, kLeft},
              {"toe1-1.L", kToes, kLeft},
              {"toe5-3.R", kToes, kRight}});
}

TEST(BoneNames, MakeHumanMotionCaptureRig) {
  expect_rig({{"Hips", kHips},
              {"LHipJoint", kHips, kLeft},
              {"LeftUpLeg", kThigh, kLeft},
              {"LeftLeg", kShin, kLeft},
              {"LowerBack", kSpine},
              {"Neck1", kNeck},
              {"RightShoulder", kClavicle, kRight},
              {"RightFingerBase", kMetacarpal, kRight},
              {"RightHandFinger1", kIndex, kRight, 1},
              {"RThumb", kThumb, kRight, 1}});
}

TEST(BoneNames, Unreal) {
  expect_rig({{"root", kUnknown},
              {"pelvis", kHips},
              {"spine_03", kSpine},
              {"neck_01", kNeck},
              {"clavicle_l", kClavicle, kLeft},
              {"upperarm_l", kUpperArm, kLeft},
              {"upperarm_twist_01_l", kUpperArm, kLeft, 0, BoneUse::kTwist},
              {"lowerarm_r", kForearm, kRight},
              {"lowerarm_twist_01_l", kForearm, kLeft, 0, BoneUse::kTwist},
              {"hand_r", kHand, kRight},
              {"index_metacarpal_l", kMetacarpal, kLeft},
              {"thumb_01_l", kThumb, kLeft, 1},
              {"middle_02_l", kMiddle, kLeft, 2},
              {"pinky_03_r", kLittle, kRight, 3},
              {"thigh_r", kThigh, kRight},
              {"thigh_twist_01_r", kThigh, kRight, 0, BoneUse::kTwist},
              {"calf_r", kShin, kRight},
              {"foot_r", kFoot, kRight},
              {"ball_r", kToes, kRight},
              {"ik_foot_root", kUnknown, kNone, 0, BoneUse::kControl},
              {"ik_hand_l", kHand, kLeft, 0, BoneUse::kControl}});
}

TEST(BoneNames, Rigify) {
  expect_rig({{"DEF-spine", kSpine},
              {"DEF-spine.003", kSpine},
              {"DEF-spine.004", kNeck},
              {"DEF-spine.006", kHead},
              {"DEF-shoulder.L", kClavicle, kLeft},
              {"DEF-upper_arm.L", kUpperArm, kLeft},
              {"DEF-upper_arm.L.001", kUpperArm, kLeft},
              {"DEF-forearm.R.001", kForearm, kRight},
              {"DEF-hand.L", kHand, kLeft},
              {"ORG-palm.01.L", kMetacarpal, kLeft},
              {"DEF-f_index.01.L", kIndex, kLeft, 1},
              {"DEF-f_pinky.03.R", kLittle, kRight, 3},
              {"DEF-thumb.02.R", kThumb, kRight, 2},
              {"DEF-thigh.L.001", kThigh, kLeft},
              {"DEF-shin.L", kShin, kLeft},
              {"DEF-foot.L", kFoot, kLeft},
              {"DEF-toe.L", kToes, kLeft},
              {"DEF-elbow-helper.L", kForearm, kLeft, 0, BoneUse::kTwist},
              {"DEF-brow.B.L.001", kFace, kLeft},
              {"DEF-lid.T.R.003", kFace, kRight},
              {"DEF-lip.T.L", kFace, kLeft},
              {"DEF-jaw.L", kFace, kLeft},
              {"jaw_master", kJaw},
              {"MCH-upper_arm_ik_target.L", kUpperArm, kLeft, 0, BoneUse::kControl},
              {"hand_ik.L", kHand, kLeft, 0, BoneUse::kControl},
              {"upper_arm_tweak.L", kUpperArm, kLeft, 0, BoneUse::kControl}});
}

TEST(BoneNames, VrmAndVroid) {
  expect_rig({{"J_Bip_C_Hips", kHips},
              {"J_Bip_C_UpperChest", kChest},
              {"J_Adj_L_FaceEye", kEye, kLeft},
              {"J_Bip_L_Shoulder", kClavicle, kLeft},
              {"J_Bip_L_UpperArm", kUpperArm, kLeft},
              {"J_Bip_R_LowerArm", kForearm, kRight},
              {"J_Bip_R_Hand", kHand, kRight},
              {"J_Bip_R_Little3", kLittle, kRight, 3},
              {"J_Bip_L_UpperLeg", kThigh, kLeft},
              {"J_Bip_L_LowerLeg", kShin, kLeft},
              {"J_Bip_L_ToeBase", kToes, kLeft},
              {"J_Sec_Hair1_01", kUnknown},
              {"J_Sec_L_Bust1", kUnknown, kLeft}});
  expect_rig({{"leftUpperArm", kUpperArm, kLeft},
              {"rightLowerLeg", kShin, kRight},
              {"leftIndexProximal", kIndex, kLeft, 1},
              {"leftLittleIntermediate", kLittle, kLeft, 2},
              {"leftThumbProximal", kThumb, kLeft, 1},
              {"leftThumbIntermediate", kThumb, kLeft, 2},
              {"leftThumbDistal", kThumb, kLeft, 3}});
  expect_rig({{"leftThumbMetacarpal", kThumb, kLeft, 1}, {"leftThumbProximal", kThumb, kLeft, 2}});
}

TEST(BoneNames, SmplNamesJoints) {
  expect_rig({{"pelvis", kHips},
              {"left_hip", kThigh, kLeft},
              {"left_knee", kShin, kLeft},
              {"left_ankle", kFoot, kLeft},
              {"left_foot", kToes, kLeft},
              {"spine3", kSpine},
              {"left_collar", kClavicle, kLeft},
              {"left_shoulder", kUpperArm, kLeft},
              {"left_elbow", kForearm, kLeft},
              {"left_wrist", kHand, kLeft},
              {"left_index1", kIndex, kLeft, 1},
              {"right_thumb3", kThumb, kRight, 3},
              {"jaw", kJaw},
              {"left_eye_smplhf", kEye, kLeft}});
  expect_rig({{"L_Hip", kThigh, kLeft},
              {"L_Ankle", kFoot, kLeft},
              {"L_Foot", kToes, kLeft},
              {"L_Shoulder", kUpperArm, kLeft},
              {"L_Elbow", kForearm, kLeft},
              {"R_Wrist", kHand, kRight}});
}

TEST(BoneNames, BipedDazAndCharacterCreator) {
  expect_rig({{"Bip01", kUnknown},
              {"Bip01 Pelvis", kHips},
              {"Bip01 Spine1", kSpine},
              {"Bip01 L Clavicle", kClavicle, kLeft},
              {"Bip01 L UpperArm", kUpperArm, kLeft},
              {"Bip01 LUpArmTwist", kUpperArm, kLeft, 0, BoneUse::kTwist},
              {"Bip01 L Forearm", kForearm, kLeft},
              {"Bip01 L ForeTwist", kForearm, kLeft, 0, BoneUse::kTwist},
              {"Bip01 L Finger0", kThumb, kLeft, 1},
              {"Bip01 L Finger02", kThumb, kLeft, 3},
              {"Bip01 L Finger1", kIndex, kLeft, 1},
              {"Bip01 R Finger42", kLittle, kRight, 3},
              {"Bip01 R Thigh", kThigh, kRight},
              {"Bip01 R Calf", kShin, kRight},
              {"Bip01 R Toe0Nub", kToes, kRight, 0, BoneUse::kEnd},
              {"ValveBiped.Bip01_L_Hand", kHand, kLeft}});
  expect_rig({{"hip", kHips},
              {"abdomenLower", kSpine},
              {"chestUpper", kChest},
              {"lCollar", kClavicle, kLeft},
              {"lShldrBend", kUpperArm, kLeft},
              {"lShldrTwist", kUpperArm, kLeft, 0, BoneUse::kTwist},
              {"rForearmBend", kForearm, kRight},
              {"rThighBend", kThigh, kRight},
              {"rMid2", kMiddle, kRight, 2}});
  expect_rig({{"CC_Base_Hip", kHips},
              {"CC_Base_Waist", kSpine},
              {"CC_Base_NeckTwist01", kNeck, kNone, 0, BoneUse::kTwist},
              {"CC_Base_L_Upperarm", kUpperArm, kLeft},
              {"CC_Base_L_ElbowShareBone", kForearm, kLeft, 0, BoneUse::kTwist},
              {"CC_Base_L_CalfTwist01", kShin, kLeft, 0, BoneUse::kTwist},
              {"CC_Base_FacialBone", kFace},
              {"CC_Base_JawRoot", kJaw}});
}

TEST(BoneNames, PlainLowerCase) {
  expect_rig({{"leftupleg", kThigh, kLeft}, {"rightforearm", kForearm, kRight}, {"handright", kHand, kRight}});
}

TEST(BoneNames, OtherWords_AreNoParts) {
  expect_rig({{"armor", kUnknown},
              {"Shirt", kUnknown},
              {"handle", kUnknown},
              {"HandBag", kUnknown},
              {"headband", kUnknown},
              {"Earring_L", kUnknown, kLeft},
              {"LeftArmor", kUnknown, kLeft},
              {"shoulder_pad_l", kUnknown, kLeft},
              {"knee_pad.R", kUnknown, kRight},
              {"footstool", kUnknown},
              {"arm", kUnknown},  // of a lamp: no side
              {"ball", kUnknown},
              {"ring", kUnknown},
              {"Tail_03", kUnknown},
              {"Bone.001", kUnknown},
              {"", kUnknown},
              {"---", kUnknown},
              {"123", kUnknown},
              {"finger99999999999999999999.L", kUnknown, kLeft}});
}

TEST(BoneNames, LeftAndRight_HaveTheSameStem) {
  const auto names = read_bone_names({"Tail_L_01", "Tail_R_01", "Tail_L_02", "leftArm", "rightArm"});
  EXPECT_EQ(names[0].stem, names[1].stem);
  EXPECT_NE(names[0].stem, names[2].stem);
  EXPECT_EQ(names[3].stem, names[4].stem);
}

}  // namespace
}  // namespace layfigure::doll
