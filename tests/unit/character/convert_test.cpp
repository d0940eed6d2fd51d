#include "convert.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace layfigure::character {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;

constexpr double kRounding = 1e-12;

Affine3d moved(double x, double y, double z) { return Affine3d(Eigen::Translation3d(x, y, z)); }

/// A tetrahedron of unit edges along the axes.
SourceMesh tetrahedron(int node) {
  SourceMesh mesh;
  mesh.name = "skin";
  mesh.node = node;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

/// As an FBX: nodes root > mesh, root > hip > helper > knee > foot; the skin names hip and knee, 1 m apart along x.
SourceScene fbx_scene() {
  SourceScene scene;
  scene.nodes = {{"root", -1, Affine3d::Identity(), false}, {"mesh", 0, Affine3d::Identity(), true},
                 {"hip", 0, moved(1, 0, 0), false},         {"knee_$AssimpFbx$_PreRotation", 2, moved(2, 0, 0), false},
                 {"knee", 3, moved(2, 0, 0), false},        {"foot", 4, moved(3, 0, 0), false}};
  SourceMesh mesh = tetrahedron(1);
  mesh.joints = {{2, moved(-1, 0, 0), {{0, 1.0}, {1, 1.0}}}, {4, moved(-2, 0, 0), {{2, 1.0}, {3, 1.0}}}};
  scene.meshes = {mesh};
  return scene;
}

std::string refusal(const SourceScene& scene) {
  try {
    (void)convert(scene);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Convert, HelperNodes_AreFoldedIntoTheBones) {
  const Rig rig = convert(fbx_scene());
  ASSERT_EQ(rig.bones.size(), 3U);
  EXPECT_EQ(rig.bones[0].name, "hip");
  EXPECT_EQ(rig.bones[1].name, "knee");
  EXPECT_EQ(rig.bones[1].parent, 0);
  EXPECT_EQ(rig.bones[2].name, "foot");
  EXPECT_LT((rig.bones[2].bind.translation() - Vector3d(3, 0, 0)).norm(), kRounding);
}

TEST(Convert, MeshWhoseTrianglesAllAreLines_IsLeftOut) {
  SourceScene scene = fbx_scene();
  SourceMesh lines = scene.meshes[0];
  lines.name = "hair";
  lines.triangles = {{0, 1, 1}, {2, 2, 3}};
  // A vertex with two texture coordinates would be two wedges, which no triangle has.
  lines.vertices[1] = lines.vertices[0];
  lines.uvs = {{0.0F, 0.0F}, {1.0F, 0.0F}, {0.0F, 1.0F}, {1.0F, 1.0F}};
  scene.meshes.push_back(lines);
  const Rig rig = convert(scene);
  ASSERT_EQ(rig.meshes.size(), 1U);
  EXPECT_EQ(rig.meshes[0].name, "skin");
  ASSERT_FALSE(rig.warnings.empty());
  EXPECT_EQ(rig.warnings.back(), "mesh 'hair' has no triangles with three different corners: left out");
  scene.meshes.erase(scene.meshes.begin());
  EXPECT_EQ(refusal(scene), "it has no triangles; export it with its mesh");
}

TEST(Convert, NodesPosedAtExport_BindsComeFromTheOffsets) {
  SourceScene scene = fbx_scene();
  const Affine3d turn(Eigen::AngleAxisd(1.0, Vector3d::UnitZ()));
  for (const int node : {4, 5}) scene.nodes[node].pose = scene.nodes[3].pose * turn * moved(node - 4.0, 0, 0);
  const Rig rig = convert(scene);
  EXPECT_LT((rig.bones[1].bind.translation() - Vector3d(2, 0, 0)).norm(), kRounding);
  EXPECT_LT((rig.bones[2].bind.translation() - Vector3d(3, 0, 0)).norm(), kRounding);  // beside its bound parent
  EXPECT_TRUE(rig.bones[1].rest.isApprox(rig.bones[0].bind.inverse() * rig.bones[1].bind, kRounding));
}

TEST(Convert, MeshNodeOfAnFbx_PlacesTheMesh) {
  SourceScene scene = fbx_scene();
  scene.nodes[1].pose = moved(0, 5, 0) * Eigen::Scaling(2.0);
  const Rig rig = convert(scene);
  EXPECT_LT((rig.meshes[0].vertices[1] - Vector3d(2, 5, 0)).norm(), kRounding);
  EXPECT_LT((rig.bones[0].bind.translation() - Vector3d(2, 5, 0)).norm(), kRounding);
}

TEST(Convert, MeshNodeOfAGltf_IsIgnored) {
  SourceScene scene = fbx_scene();
  scene.skin_replaces_node = true;
  scene.nodes[1].pose = moved(0, 5, 0) * Eigen::Scaling(2.0);
  const Rig rig = convert(scene);
  EXPECT_LT((rig.meshes[0].vertices[1] - Vector3d(1, 0, 0)).norm(), kRounding);
  EXPECT_LT((rig.bones[0].bind.translation() - Vector3d(1, 0, 0)).norm(), kRounding);
}

TEST(Convert, UnitsAndAxes_ApplyToBonesAndMesh) {
  SourceScene scene = fbx_scene();
  scene.world_from_file = Affine3d(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()) * Eigen::Scaling(0.01));
  const Rig rig = convert(scene);
  EXPECT_LT((rig.meshes[0].vertices[2] - Vector3d(0, 0, 0.01)).norm(), kRounding);
  EXPECT_LT((rig.bones[1].bind.translation() - Vector3d(0.02, 0, 0)).norm(), kRounding);
  EXPECT_NEAR(rig.bones[1].bind.linear().determinant(), 1.0, kRounding);
}

TEST(Convert, MirroredAndShearedBones_AreMadeRigid) {
  SourceScene scene = fbx_scene();
  Affine3d odd = moved(2, 0, 0);
  odd.linear() << -1, 0.2, 0, 0, 3, 0, 0, 0, 1;
  scene.meshes[0].joints[1].offset = odd.inverse();
  const Rig rig = convert(scene);
  const Eigen::Matrix3d R = rig.bones[1].bind.linear();
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), kRounding);
  EXPECT_NEAR(R.determinant(), 1.0, kRounding);
}

BoneLimits some_limits() {
  BoneLimits limits;
  limits.axes = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3d::UnitX()));
  limits.lower.x() = -0.5;
  return limits;
}

TEST(Convert, LimitsOfAJoint_AreItsBones) {
  SourceScene scene = fbx_scene();
  scene.nodes[4].limits = some_limits();
  const Rig rig = convert(scene);
  ASSERT_TRUE(rig.bones[1].limits.has_value());
  EXPECT_EQ(rig.bones[1].limits->lower.x(), -0.5);
  EXPECT_EQ(rig.bones[1].limits->upper.x(), BoneLimits::kInfinity);
  EXPECT_EQ(rig.bones[1].limits->axes.coeffs(), some_limits().axes.coeffs());
  EXPECT_NE(rig.content_hash, convert(fbx_scene()).content_hash);
}

TEST(Convert, LimitsOfTheRoot_AreNone) {
  SourceScene scene = fbx_scene();
  scene.nodes[2].limits = some_limits();
  EXPECT_FALSE(convert(scene).bones[0].limits.has_value());
}

TEST(Convert, LimitsOfAMirroredJoint_AreLeftOutAndReported) {
  for (const int joint : {0, 1}) {  // the joint above, and its own
    SourceScene scene = fbx_scene();
    scene.nodes[4].limits = some_limits();
    scene.meshes[0].joints[joint].offset.linear() = Vector3d(-1, 1, 1).asDiagonal();
    const Rig rig = convert(scene);
    EXPECT_FALSE(rig.bones[1].limits.has_value());
    bool reported = false;
    for (const std::string& warning : rig.warnings) reported |= warning.find("'knee' is mirrored") != std::string::npos;
    EXPECT_TRUE(reported) << joint;
  }
}

TEST(Convert, MirroredMesh_KeepsFacingOutwards) {
  SourceScene scene = fbx_scene();
  scene.nodes[1].pose = Affine3d(Eigen::Scaling(-1.0, 1.0, 1.0));
  const Rig rig = convert(scene);
  double volume6 = 0.0;
  for (const auto& t : rig.meshes[0].triangles) {
    const auto& v = rig.meshes[0].vertices;
    volume6 += v[t[0]].dot(v[t[1]].cross(v[t[2]]));
  }
  EXPECT_NEAR(volume6, 1.0, kRounding);
  EXPECT_TRUE(rig.warnings.empty());
}

TEST(Convert, MeshInsideOut_IsTurnedAndReported) {
  SourceScene scene = fbx_scene();
  for (auto& triangle : scene.meshes[0].triangles) std::swap(triangle[0], triangle[1]);
  const Rig rig = convert(scene);
  EXPECT_EQ(rig.meshes[0].triangles[0], Eigen::Vector3i(2, 1, 0));
  ASSERT_EQ(rig.warnings.size(), 1U);
  EXPECT_NE(rig.warnings[0].find("inwards"), std::string::npos);
}

TEST(Convert, NormalsOfAMirroredAndStretchedMesh_StayNormalToIt) {
  SourceScene scene = fbx_scene();
  scene.nodes[1].pose = Affine3d(Eigen::Scaling(-1.0, 2.0, 3.0));
  scene.meshes[0].normals.assign(4, Vector3d(1, 1, 1));  // of the slanted face
  const Rig rig = convert(scene);
  ASSERT_EQ(rig.meshes[0].wedges.normals.size(), 4U);
  const Vector3d expected = Vector3d(-1.0, 1.0 / 2.0, 1.0 / 3.0).normalized();
  for (const auto& normal : rig.meshes[0].wedges.normals) EXPECT_LT((normal.cast<double>() - expected).norm(), 1e-6);
}

TEST(Convert, NormalsOfAMeshInsideOut_AreTurnedWithIt) {
  SourceScene scene = fbx_scene();
  for (const auto& vertex : scene.meshes[0].vertices) {
    scene.meshes[0].normals.push_back(Vector3d::Constant(0.25) - vertex);  // inwards
  }
  for (auto& triangle : scene.meshes[0].triangles) std::swap(triangle[0], triangle[1]);
  const SkinnedMesh mesh = convert(scene).meshes.at(0);
  for (std::size_t v = 0; v < 4; ++v) {
    EXPECT_GT(mesh.wedges.normals[v].cast<double>().dot(mesh.vertices[v] - Vector3d::Constant(0.25)), 0.0);
  }
}

TEST(Convert, NormalsOutwardsOfAMeshInsideOut_Stay) {
  SourceScene scene = fbx_scene();
  for (const auto& vertex : scene.meshes[0].vertices) {
    scene.meshes[0].normals.push_back(vertex - Vector3d::Constant(0.25));
  }
  for (auto& triangle : scene.meshes[0].triangles) std::swap(triangle[0], triangle[1]);
  const SkinnedMesh mesh = convert(scene).meshes.at(0);
  EXPECT_GT(mesh.wedges.normals[1].x(), 0.5F);
}

TEST(Convert, NormalsWithoutDirection_AreMadeOfTheTrianglesAndReported) {
  SourceScene scene = fbx_scene();
  scene.meshes[0].normals = {{-1, 0, 0}, {0, 0, 0}, {std::nan(""), 0, 0}, {0, 0, 2}};
  const Rig rig = convert(scene);
  const auto& normals = rig.meshes[0].wedges.normals;
  for (const auto& normal : normals) EXPECT_NEAR(normal.norm(), 1.0F, 1e-6F);
  EXPECT_EQ(normals[3], Eigen::Vector3f::UnitZ());
  // Twice the areas of the faces at vertex 1, with their sides: z = 0 down, y = 0 forth, and the slanted one.
  EXPECT_LT((normals[1] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-6F);
  ASSERT_EQ(rig.warnings.size(), 1U);
  EXPECT_NE(rig.warnings[0].find("2 normals have no direction"), std::string::npos);
}

TEST(Convert, TextureCoordinatesNotFinite_AreZeroAndReported) {
  SourceScene scene = fbx_scene();
  scene.meshes[0].uvs = {{0.0F, 0.5F}, {std::numeric_limits<float>::infinity(), 0.5F}, {1.0F, 0.0F}, {0.25F, 0.75F}};
  const Rig rig = convert(scene);
  EXPECT_EQ(rig.meshes[0].wedges.uvs[1], Eigen::Vector2f::Zero());
  EXPECT_EQ(rig.meshes[0].wedges.uvs[3], Eigen::Vector2f(0.25F, 0.75F));
  ASSERT_EQ(rig.warnings.size(), 1U);
  EXPECT_NE(rig.warnings[0].find("1 texture coordinates are not finite"), std::string::npos);
}

TEST(Convert, MaterialsAndImages_AreThoseThatAreUsed) {
  SourceScene scene = fbx_scene();
  scene.materials.resize(3);
  scene.materials[0].name = "of nothing";
  scene.materials[2].name = "skin";
  scene.materials[0].image = 0;
  scene.materials[2].image = 1;
  scene.images = {{"unused", "png", "u"}, {"skin", "png", "s"}};
  scene.meshes[0].material = 2;
  scene.meshes.push_back(scene.meshes[0]);
  const Rig rig = convert(scene);
  ASSERT_EQ(rig.materials.size(), 1U);
  EXPECT_EQ(rig.materials[0].name, "skin");
  EXPECT_EQ(rig.materials[0].image, 0);
  ASSERT_EQ(rig.images.size(), 1U);
  EXPECT_EQ(rig.images[0].bytes, "s");
  EXPECT_EQ(rig.meshes[0].material, 0);
  EXPECT_EQ(rig.meshes[1].material, 0);
}

TEST(Convert, OtherLooks_OtherHash) {
  SourceScene scene = fbx_scene();
  scene.materials.resize(1);
  scene.meshes[0].material = 0;
  scene.meshes[0].uvs.assign(4, {0.25F, 0.5F});
  const std::uint64_t hash = convert(scene).content_hash;
  SourceScene other = scene;
  other.materials[0].texture = "skin.png";
  EXPECT_NE(convert(other).content_hash, hash);
  other = scene;
  other.meshes[0].uvs[1].x() = 0.5F;
  EXPECT_NE(convert(other).content_hash, hash);
  EXPECT_EQ(convert(scene).content_hash, hash);
}

TEST(Convert, TwoSkinsThatDisagree_TheFirstCountsAndItIsReported) {
  SourceScene scene = fbx_scene();
  SourceMesh second = scene.meshes[0];
  second.name = "coat";
  second.joints[1].offset = moved(-2.5, 0, 0);
  scene.meshes.push_back(second);
  const Rig rig = convert(scene);
  EXPECT_LT((rig.bones[1].bind.translation() - Vector3d(2, 0, 0)).norm(), kRounding);
  ASSERT_EQ(rig.warnings.size(), 1U);
  EXPECT_NE(rig.warnings[0].find("'knee' is bound differently by mesh 'coat'"), std::string::npos);
}

TEST(Convert, NegativeWeights_CountAsNone) {
  SourceScene scene = fbx_scene();
  scene.meshes[0].joints[0].weights.push_back({2, -3.0});
  const Rig rig = convert(scene);
  for (const auto& influences : rig.meshes[0].influences) {
    for (const Influence& influence : influences) EXPECT_GT(influence.weight, 0.0);
  }
}

TEST(Convert, WeightNotFinite_NamesTheBone) {
  SourceScene scene = fbx_scene();
  scene.meshes[0].joints[1].weights[0].weight = std::nan("");
  EXPECT_NE(refusal(scene).find("bone 'knee'"), std::string::npos);
}

TEST(Convert, TooManyBones_AreRefused) {
  SourceScene scene = fbx_scene();
  for (int k = 0; k < 20000; ++k) {
    scene.nodes.push_back(
        {"tail" + std::to_string(k), static_cast<int>(scene.nodes.size()) - 1, moved(3, 0, 0), false});
  }
  EXPECT_NE(refusal(scene).find("more than 16384"), std::string::npos);
}

TEST(Convert, NodePoseNotFinite_IsRefused) {
  SourceScene scene = fbx_scene();
  scene.nodes[4].pose.translation().x() = std::nan("");
  EXPECT_NE(refusal(scene).find("node 'knee'"), std::string::npos);
}

TEST(Convert, NodeOfNoSize_IsRefusedWhereABoneNeedsIt) {
  SourceScene scene = fbx_scene();
  scene.nodes[4].pose.linear().setZero();
  EXPECT_NE(refusal(scene).find("bone 'foot'"), std::string::npos);
}

}  // namespace
}  // namespace layfigure::character
