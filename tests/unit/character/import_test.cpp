#include <gtest/gtest.h>

#include <cstring>

#include "glb_fixture.h"
#include "layfigure/character/import.h"

namespace layfigure::character::test {
namespace {

using Eigen::Vector3d;

constexpr double kFloatRounding = 1e-6;  // files hold floats

Rig import_bytes(const GlbFile& file) {
  const TemporaryFolder folder;
  return import_rig(folder.write("bar.glb", file.bytes()));
}

Vector3d origin(const Rig& rig, int bone) { return rig.bones[bone].bind.translation(); }

std::vector<std::string> names(const Rig& rig) {
  std::vector<std::string> result;
  for (const Bone& bone : rig.bones) result.push_back(bone.name);
  return result;
}

Eigen::AlignedBox3d bounds(const SkinnedMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex);
  return box;
}

bool has_warning(const Rig& rig, const std::string& text) {
  for (const std::string& warning : rig.warnings) {
    if (warning.find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(ImportRig, Bar_HasItsBonesInTheWorldZUp) {
  const Rig rig = import_bytes(make_bar());
  EXPECT_EQ(rig.name, "bar");
  EXPECT_EQ(rig.source_file, "bar.glb");
  ASSERT_EQ(names(rig), (std::vector<std::string>{"low", "high", "tip"}));
  EXPECT_EQ(rig.bones[0].parent, -1);
  EXPECT_EQ(rig.bones[1].parent, 0);
  EXPECT_EQ(rig.bones[2].parent, 1);
  EXPECT_LT((origin(rig, 1) - Vector3d(0, 0, 1)).norm(), kFloatRounding);
  EXPECT_LT((origin(rig, 2) - Vector3d(0, 0, 2)).norm(), kFloatRounding);
  EXPECT_LT((rig.bones[1].rest.translation() - Vector3d(0, 1, 0)).norm(), kFloatRounding);  // in its parent's axes
  EXPECT_TRUE(rig.warnings.empty());
}

TEST(ImportRig, Bar_HasItsMeshInTheWorldZUp) {
  const Rig rig = import_bytes(make_bar());
  ASSERT_EQ(rig.meshes.size(), 1U);
  const SkinnedMesh& mesh = rig.meshes[0];
  EXPECT_EQ(mesh.vertices.size(), 12U);
  EXPECT_EQ(mesh.triangles.size(), 20U);
  EXPECT_LT((bounds(mesh).min() - Vector3d(-0.1, -0.1, 0)).norm(), kFloatRounding);
  EXPECT_LT((bounds(mesh).max() - Vector3d(0.1, 0.1, 2)).norm(), kFloatRounding);
}

TEST(ImportRig, Weights_SumToOneHeaviestFirst) {
  GlbFile file = make_bar();
  for (int vertex = 0; vertex < 12; ++vertex) {
    file.set_float(kWeights, 4 * vertex, 0.3F);
    file.set_float(kWeights, 4 * vertex + 1, 0.9F);
  }
  const Rig rig = import_bytes(file);
  for (const auto& influences : rig.meshes[0].influences) {
    ASSERT_EQ(influences.size(), 2U);
    EXPECT_EQ(influences[0].bone, 1);
    EXPECT_NEAR(influences[0].weight, 0.75, kFloatRounding);
    EXPECT_NEAR(influences[0].weight + influences[1].weight, 1.0, 1e-15);
  }
}

TEST(ImportRig, VerticesWithoutWeight_FollowABoneAndAreReported) {
  GlbFile file = make_bar();
  for (int k = 0; k < 4; ++k) file.set_float(kWeights, k, 0.0F);
  const Rig rig = import_bytes(file);
  for (const auto& influences : rig.meshes[0].influences) EXPECT_FALSE(influences.empty());
  EXPECT_TRUE(has_warning(rig, "1 vertices have no weight"));
}

TEST(ImportRig, ArmatureInCentimetresLyingDown_IsStoodUpInMetres) {
  GlbFile file = make_bar();
  // As Blender writes an FBX-born armature: the bones in centimetres below a node that scales and turns.
  file.json["nodes"][0]["scale"] = {0.01, 0.01, 0.01};
  file.json["nodes"][0]["rotation"] = {-0.70710678, 0, 0, 0.70710678};
  file.json["nodes"][2]["translation"] = {0, 100, 0};
  file.json["nodes"][3]["translation"] = {0, 100, 0};
  for (int k = 0; k < 12 * 3; ++k) {
    float value = 0.0F;
    std::memcpy(&value, file.data.data() + 4 * k, 4);
    file.set_float(kPositions, k, 100.0F * value);
  }
  for (int bone = 0; bone < 3; ++bone)
    file.set_float(kInverseBinds, 16 * bone + 13, -100.0F * static_cast<float>(bone));
  const Rig rig = import_bytes(file);
  // Turned by -90 degrees about X in glTF's axes, what was up (y) is away from the viewer (-z): +y in the world.
  EXPECT_LT((origin(rig, 1) - Vector3d(0, 1, 0)).norm(), kFloatRounding);
  EXPECT_NEAR(bounds(rig.meshes[0]).sizes().y(), 2.0, kFloatRounding);
  for (const Bone& bone : rig.bones) {
    EXPECT_LT((bone.bind.linear() * bone.bind.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  }
}

TEST(ImportRig, NodesSavedInAnotherPose_RestIsTheBindPose) {
  GlbFile file = make_bar();
  file.json["nodes"][2]["rotation"] = {0, 0, 0.70710678, 0.70710678};
  file.json["nodes"][2]["translation"] = {0.3, 1, 0};
  const Rig rig = import_bytes(file);
  EXPECT_LT((origin(rig, 1) - Vector3d(0, 0, 1)).norm(), kFloatRounding);
  EXPECT_TRUE(rig.bones[1].bind.linear().isApprox(rig.bones[0].bind.linear(), kFloatRounding));
  for (const Bone& bone : rig.bones) {
    if (bone.parent < 0) continue;
    EXPECT_TRUE((rig.bones[bone.parent].bind * bone.rest).isApprox(bone.bind, 1e-12));
  }
}

TEST(ImportRig, EmptyNodesBelowAJoint_AreBones) {
  GlbFile file = make_bar();
  file.json["nodes"].push_back({{"name", "tip_end"}, {"translation", {0, 0.5, 0}}});
  file.json["nodes"][3]["children"] = {5};
  const Rig rig = import_bytes(file);
  ASSERT_EQ(rig.bones.size(), 4U);
  EXPECT_EQ(rig.bones[3].name, "tip_end");
  EXPECT_EQ(rig.bones[3].parent, 2);
  EXPECT_LT((origin(rig, 3) - Vector3d(0, 0, 2.5)).norm(), kFloatRounding);
}

TEST(ImportRig, SeveralRoots_AreJoinedByTheNodeAboveThem) {
  GlbFile file = make_bar();
  file.json["nodes"][0]["children"] = {1, 2};
  file.json["nodes"][1].erase("children");
  const Rig rig = import_bytes(file);
  ASSERT_EQ(names(rig), (std::vector<std::string>{"armature", "low", "high", "tip"}));
  EXPECT_EQ(rig.bones[1].parent, 0);
  EXPECT_EQ(rig.bones[2].parent, 0);
}

TEST(ImportRig, TwoMeshes_OneOnABone_OneOnNone) {
  GlbFile file = make_bar();
  file.json["meshes"].push_back(
      {{"name", "box"}, {"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}});
  file.json["nodes"].push_back({{"name", "hat"}, {"mesh", 1}, {"translation", {0, 3, 0}}});
  file.json["nodes"].push_back({{"name", "floor"}, {"mesh", 1}});
  file.json["nodes"][3]["children"] = {5};
  file.json["scenes"][0]["nodes"] = {0, 4, 6};
  const Rig rig = import_bytes(file);
  ASSERT_EQ(rig.bones.size(), 3U);
  ASSERT_EQ(rig.meshes.size(), 2U);
  const auto& hat = bounds(rig.meshes[0]).min().z() > 1.0 ? rig.meshes[0] : rig.meshes[1];
  EXPECT_NEAR(bounds(hat).min().z(), 5.0, kFloatRounding);
  for (const auto& influences : hat.influences) {
    ASSERT_EQ(influences.size(), 1U);
    EXPECT_EQ(influences[0].bone, 2);
  }
  EXPECT_TRUE(has_warning(rig, "hangs on no bone: left out"));
}

TEST(ImportRig, NamesEmptyOrTwice_AreMadeUnique) {
  GlbFile file = make_bar();
  file.json["nodes"][2]["name"] = "low";
  file.json["nodes"][3].erase("name");
  const Rig rig = import_bytes(file);
  ASSERT_EQ(rig.bones.size(), 3U);
  for (const Bone& bone : rig.bones) EXPECT_FALSE(bone.name.empty());
  EXPECT_NE(rig.bones[0].name, rig.bones[1].name);
  EXPECT_NE(rig.bones[1].name, rig.bones[2].name);
  EXPECT_NE(rig.bones[0].name, rig.bones[2].name);
  EXPECT_LT((origin(rig, 1) - Vector3d(0, 0, 1)).norm(), kFloatRounding);
}

TEST(ImportRig, SameFileTwice_SameHash) {
  EXPECT_EQ(import_bytes(make_bar()).content_hash, import_bytes(make_bar()).content_hash);
}

TEST(ImportRig, OtherVertex_OtherHash) {
  GlbFile file = make_bar();
  const std::uint64_t hash = import_bytes(file).content_hash;
  file.set_float(kPositions, 0, 0.1001F);
  EXPECT_NE(import_bytes(file).content_hash, hash);
}

}  // namespace
}  // namespace layfigure::character::test
