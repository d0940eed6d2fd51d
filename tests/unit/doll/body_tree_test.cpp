#include "body_tree.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using character::Bone;
using character::Rig;

BodyTree tree_of(const Rig& rig) {
  const Surface surface = make_surface(rig);
  return make_body_tree(rig.bones, surface, triangle_owners(surface));
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

TEST(BodyTree, NoTriangles_IsRefused) {
  Rig rig = test::make_prism({.bones = 1});
  rig.meshes[0].triangles.clear();
  EXPECT_THROW((void)tree_of(rig), std::invalid_argument);
}

}  // namespace
}  // namespace layfigure::doll
