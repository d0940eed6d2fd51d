#include "body_tree.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "person_fixture.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using character::Bone;
using character::Rig;

BodyTree tree_of(const Rig& rig, const std::vector<MergeChoice>& choices = {}) {
  const Surface surface = make_surface(rig);
  std::vector<std::string> names;
  for (const Bone& bone : rig.bones) names.push_back(bone.name);
  return make_body_tree(rig.bones, read_bone_names(names), surface, triangle_owners(surface), choices);
}

int bone_called(const Rig& rig, const std::string& name) {
  for (std::size_t b = 0; b < rig.bones.size(); ++b) {
    if (rig.bones[b].name == name) return static_cast<int>(b);
  }
  throw std::invalid_argument("no bone '" + name + "'");
}

/// The bone whose body carries the bone.
std::string carrier_of(const Rig& rig, const BodyTree& tree, const std::string& name) {
  const int body = tree.carrier_of_bone[bone_called(rig, name)];
  return body < 0 ? "" : rig.bones[tree.bone_of_body[body]].name;
}

BoneReason reason_of(const Rig& rig, const BodyTree& tree, const std::string& name) {
  return tree.roles[bone_called(rig, name)].reason;
}

/// Renames a bone of the person.
Rig renamed(Rig rig, const std::string& from, const std::string& to) {
  rig.bones[bone_called(rig, from)].name = to;
  return rig;
}

Bone bone(const std::string& name, int parent) {
  Bone result;
  result.name = name;
  result.parent = parent;
  return result;
}

/// Adds a bone above all others, which loses them their first place but not their order.
void add_bone_above(Rig& rig) {
  for (Bone& other : rig.bones) ++other.parent;
  rig.bones.insert(rig.bones.begin(), bone("above", -1));
  for (auto& mesh : rig.meshes) {
    for (auto& influences : mesh.influences) {
      for (auto& influence : influences) ++influence.bone;
    }
  }
}

TEST(BodyTree, EveryBoneWithSkin_IsABody) {
  const BodyTree tree = tree_of(test::make_prism({.bones = 3}));
  EXPECT_EQ(tree.bone_of_body, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(tree.parent_of_body, (std::vector<int>{-1, 0, 1}));
  EXPECT_EQ(tree.carrier_of_bone, (std::vector<int>{0, 1, 2}));
}

TEST(BodyTree, BonesWithoutSkin_RideOnTheNearestAbove) {
  Rig rig = test::make_prism({.bones = 2});
  rig.bones.push_back(bone("tip", 1));
  rig.bones.push_back(bone("tip_end", 2));
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(tree.bone_of_body.size(), 2U);
  EXPECT_EQ(tree.carrier_of_bone, (std::vector<int>{0, 1, 1, 1}));
}

TEST(BodyTree, BoneWithoutSkinBetween_IsSkippedByTheBodies) {
  Rig rig = test::make_prism({.bones = 2});
  rig.bones.insert(rig.bones.begin() + 1, bone("between", 0));
  rig.bones[2].parent = 1;
  for (auto& influences : rig.meshes[0].influences) {
    for (auto& influence : influences) influence.bone = influence.bone == 1 ? 2 : influence.bone;
  }
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(tree.bone_of_body, (std::vector<int>{0, 2}));
  EXPECT_EQ(tree.parent_of_body, (std::vector<int>{-1, 0}));
  EXPECT_EQ(tree.carrier_of_bone, (std::vector<int>{0, 0, 1}));
}

TEST(BodyTree, BoneAboveSeveralLimbs_RidesOnTheOneWithMostSkinAndJoinsThem) {
  Rig rig = test::make_prism({.prefix = "thin", .bones = 1, .radius = 0.02});
  test::add_prism(rig, {.prefix = "thick", .bones = 1, .radius = 0.2}, -1);
  add_bone_above(rig);
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(tree.bone_of_body, (std::vector<int>{2, 1}));  // thick first: it is the root
  EXPECT_EQ(tree.parent_of_body, (std::vector<int>{-1, 0}));
  EXPECT_EQ(tree.carrier_of_bone, (std::vector<int>{0, 1, 0}));
}

TEST(BodyTree, SeveralRootBones_AreSeveralRootBodies) {
  Rig rig = test::make_prism({.prefix = "a", .bones = 1});
  test::add_prism(rig, {.prefix = "b", .bones = 1, .pose = test::odd_motion()}, -1);
  EXPECT_EQ(tree_of(rig).parent_of_body, (std::vector<int>{-1, -1}));
}

TEST(BodyTree, TreeWithoutSkin_StaysWhereItIs) {
  Rig rig = test::make_prism({.bones = 1});
  rig.bones.push_back(bone("control", -1));
  EXPECT_EQ(tree_of(rig).carrier_of_bone, (std::vector<int>{0, -1}));
}

TEST(BodyTree, BoneWithASpeckOfSkin_IsNoBody) {
  Rig rig = test::make_prism({.bones = 1});
  rig.bones.push_back(bone("speck", 0));
  rig.meshes[0].influences[0] = {{1, 1.0}};  // one corner: no triangle has it as its owner
  EXPECT_EQ(tree_of(rig).bone_of_body.size(), 1U);
}

TEST(BodyTree, PersonWithFingers_IsAllBodies) {
  const Rig rig = test::make_person();
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(tree.bone_of_body.size(), rig.bones.size());
  for (const BoneRole& role : tree.roles) EXPECT_EQ(reason_text(role.reason), "own skin");
}

TEST(BodyTree, TwistHelper_IsMergedIntoItsLimb) {
  Rig rig = test::make_person();
  const int forearm = bone_called(rig, "LeftForeArm");
  test::add_limb(rig, "LeftForeArmTwist", forearm, {0.6, 0, 1.45}, {0.69, 0, 1.45}, 0.04);
  const int arm = bone_called(rig, "LeftArm");
  // Beside its limb: that could not carry it at a constant distance from its parent.
  test::add_limb(rig, "lowerarm_twist_01_l", arm, {0.5, 0, 1.45}, {0.59, 0, 1.45}, 0.04);
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(carrier_of(rig, tree, "LeftForeArmTwist"), "LeftForeArm");
  EXPECT_EQ(carrier_of(rig, tree, "lowerarm_twist_01_l"), "LeftArm");
  EXPECT_EQ(reason_of(rig, tree, "lowerarm_twist_01_l"), BoneReason::kTwistHelper);
}

TEST(BodyTree, LimbWithAllItsSkinOnTwistHelpers_IsABody) {
  Rig rig = test::make_person();
  const int thigh = bone_called(rig, "LeftUpLeg");
  const int helper = static_cast<int>(rig.bones.size());
  Bone twist = bone("thigh_twist_01_l", thigh);
  twist.bind = rig.bones[thigh].bind;
  rig.bones.push_back(twist);
  for (auto& influences : rig.meshes[thigh].influences) influences = {{helper, 1.0}};
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(carrier_of(rig, tree, "thigh_twist_01_l"), "LeftUpLeg");
  EXPECT_EQ(carrier_of(rig, tree, "LeftUpLeg"), "LeftUpLeg");
}

TEST(BodyTree, TwistHelperWithoutALimb_IsABodyByItself) {
  const Rig rig = renamed(test::make_person(), "Neck", "CC_Base_NeckTwist01");
  EXPECT_EQ(reason_of(rig, tree_of(rig), "CC_Base_NeckTwist01"), BoneReason::kOwnSkin);
}

TEST(BodyTree, SegmentOfALimb_IsMergedAndTheNextLimbHangsOnTheFirst) {
  // An upper arm of two bones: the forearm becomes its second one, the hand the forearm.
  Rig rig = renamed(test::make_person({.fingers = false}), "LeftArm", "upper_arm.L");
  rig = renamed(renamed(rig, "LeftForeArm", "upper_arm.L.001"), "LeftHand", "forearm.L");
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(carrier_of(rig, tree, "upper_arm.L.001"), "upper_arm.L");
  EXPECT_EQ(reason_of(rig, tree, "upper_arm.L.001"), BoneReason::kSegment);
  const int forearm = tree.carrier_of_bone[bone_called(rig, "forearm.L")];
  EXPECT_EQ(rig.bones[tree.bone_of_body[tree.parent_of_body[forearm]]].name, "upper_arm.L");
}

TEST(BodyTree, LegsOfASpider_KeepTheirJoints) {
  Rig rig;
  int parent = test::add_limb(rig, "body", -1, {0, 0, 0.5}, {0, 0.3, 0.5}, 0.1);
  const std::vector<Eigen::Vector3d> joints{{0.1, 0, 0.5}, {0.3, 0, 0.8}, {0.6, 0, 0.4}, {0.7, 0, 0}};
  for (std::size_t k = 0; k + 1 < joints.size(); ++k) {
    parent = test::add_limb(rig, "leg_0" + std::to_string(k) + ".L", parent, joints[k], joints[k + 1], 0.02);
  }
  EXPECT_EQ(tree_of(rig).bone_of_body.size(), 4U);
}

TEST(BodyTree, EveryBone_IsCarriedByItsOwnBodyOrAsItsParentIs) {
  Rig rig = test::make_person();
  const int head = bone_called(rig, "Head");
  const int jaw = test::add_limb(rig, "jaw", head, {0, -0.02, 1.63}, {0, -0.1, 1.6}, 0.03);
  test::add_limb(rig, "tongue01", jaw, {0, -0.04, 1.64}, {0, -0.08, 1.64}, 0.015);
  test::add_limb(rig, "lowerarm_twist_01_l", bone_called(rig, "LeftArm"), {0.5, 0, 1.45}, {0.59, 0, 1.45}, 0.04);
  const BodyTree tree = tree_of(rig);
  for (std::size_t b = 0; b < rig.bones.size(); ++b) {
    const int body = tree.carrier_of_bone[b];
    if (tree.bone_of_body[body] == static_cast<int>(b)) continue;
    EXPECT_EQ(body, tree.carrier_of_bone[rig.bones[b].parent]) << rig.bones[b].name;
  }
}

TEST(BodyTree, MetacarpalsAndHalvesOfTheHips_AreMerged) {
  Rig rig = test::make_person();
  test::add_limb(rig, "metacarpal1.L", bone_called(rig, "LeftHand"), {0.7, -0.03, 1.45}, {0.78, -0.03, 1.45}, 0.01);
  test::add_limb(rig, "RHipJoint", bone_called(rig, "Hips"), {-0.02, 0, 0.95}, {-0.1, 0, 0.95}, 0.08);
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(carrier_of(rig, tree, "metacarpal1.L"), "LeftHand");
  EXPECT_EQ(carrier_of(rig, tree, "RHipJoint"), "Hips");
}

TEST(BodyTree, FaceBones_AreMergedIntoTheHeadButTheJawIsABody) {
  Rig rig = test::make_person();
  const int head = bone_called(rig, "Head");
  const int jaw = test::add_limb(rig, "jaw", head, {0, -0.02, 1.63}, {0, -0.1, 1.6}, 0.03);
  test::add_limb(rig, "tongue01", jaw, {0, -0.04, 1.64}, {0, -0.08, 1.64}, 0.015);
  test::add_limb(rig, "brow.T.L", head, {0.02, -0.09, 1.75}, {0.05, -0.09, 1.75}, 0.01);
  test::add_limb(rig, "eye.R", head, {-0.03, -0.07, 1.72}, {-0.03, -0.09, 1.72}, 0.012);
  test::add_limb(rig, "ponytail", head, {0, 0.1, 1.7}, {0, 0.15, 1.4}, 0.03);
  const BodyTree tree = tree_of(rig);
  for (const char* name : {"brow.T.L", "eye.R"}) {
    EXPECT_EQ(carrier_of(rig, tree, name), "Head");
    EXPECT_EQ(reason_of(rig, tree, name), BoneReason::kFace);
  }
  EXPECT_EQ(carrier_of(rig, tree, "tongue01"), "jaw");
  EXPECT_EQ(reason_of(rig, tree, "jaw"), BoneReason::kOwnSkin);
  EXPECT_EQ(reason_of(rig, tree, "ponytail"), BoneReason::kOwnSkin);
}

TEST(BodyTree, ControlsAndEnds_RideAndSayWhy) {
  Rig rig = test::make_person();
  rig.bones.push_back(bone("ik_hand_l", bone_called(rig, "LeftHand")));
  rig.bones.push_back(bone("HeadTop_End", bone_called(rig, "Head")));
  const BodyTree tree = tree_of(rig);
  EXPECT_EQ(carrier_of(rig, tree, "ik_hand_l"), "LeftHand");
  EXPECT_EQ(reason_of(rig, tree, "ik_hand_l"), BoneReason::kControl);
  EXPECT_EQ(carrier_of(rig, tree, "HeadTop_End"), "Head");
  EXPECT_EQ(reason_of(rig, tree, "HeadTop_End"), BoneReason::kNoSkin);
}

TEST(BodyTree, TinyBones_AreMergedFromTheTipsInwards) {
  Rig rig = test::make_person();
  const int hand = bone_called(rig, "LeftHand");
  const int ring = test::add_limb(rig, "charm0", hand, {0.8, 0, 1.45}, {0.804, 0, 1.45}, 0.002);
  test::add_limb(rig, "charm1", ring, {0.804, 0, 1.45}, {0.808, 0, 1.45}, 0.002);
  const BodyTree tree = tree_of(rig);
  for (const char* name : {"charm0", "charm1"}) {
    EXPECT_EQ(carrier_of(rig, tree, name), "LeftHand");
    EXPECT_EQ(reason_of(rig, tree, name), BoneReason::kTooSmall);
  }
}

TEST(BodyTree, Choices_OverruleTheRules) {
  Rig rig = test::make_person();
  test::add_limb(rig, "charm", bone_called(rig, "LeftHand"), {0.8, 0, 1.45}, {0.804, 0, 1.45}, 0.002);
  std::vector<MergeChoice> choices(rig.bones.size(), MergeChoice::kAutomatic);
  choices[bone_called(rig, "charm")] = MergeChoice::kBody;
  choices[bone_called(rig, "Neck")] = MergeChoice::kMerge;
  const BodyTree tree = tree_of(rig, choices);
  EXPECT_EQ(reason_of(rig, tree, "charm"), BoneReason::kBodyChosen);
  EXPECT_EQ(carrier_of(rig, tree, "Neck"), "Chest");
  EXPECT_EQ(reason_of(rig, tree, "Neck"), BoneReason::kMergeChosen);
  const int head = tree.carrier_of_bone[bone_called(rig, "Head")];
  EXPECT_EQ(rig.bones[tree.bone_of_body[tree.parent_of_body[head]]].name, "Chest");
}

TEST(BodyTree, ChoicesThatCannotBeMet_AreRefused) {
  Rig rig = test::make_person();
  rig.bones.push_back(bone("tip", bone_called(rig, "Head")));
  std::vector<MergeChoice> choices(rig.bones.size(), MergeChoice::kAutomatic);
  choices.back() = MergeChoice::kBody;
  EXPECT_THROW((void)tree_of(rig, choices), UnmetChoice);
  choices.back() = MergeChoice::kAutomatic;
  choices.front() = MergeChoice::kMerge;
  EXPECT_THROW((void)tree_of(rig, choices), UnmetChoice);
}

TEST(BodyTree, NoTriangles_IsRefused) {
  Rig rig = test::make_prism({.bones = 1});
  rig.meshes[0].triangles.clear();
  EXPECT_THROW((void)tree_of(rig), std::invalid_argument);
}

}  // namespace
}  // namespace layfigure::doll
