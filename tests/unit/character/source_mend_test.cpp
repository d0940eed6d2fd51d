#include "source_mend.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "data_uri.h"
#include "glb_fixture.h"
#include "gltf_coordinates.h"
#include "layfigure/character/import.h"
#include "unbound_skin.h"

namespace layfigure::character {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;

constexpr double kRounding = 1e-12;
constexpr double kFloatRounding = 1e-6;

TEST(MendSource, ColladaTextsWithSpaceBefore_LoseIt) {
  EXPECT_EQ(mend_source("<a> \n\t<b x='1 > 0'>  1 2 </b> </a>", ".DAE"), "<a> \n\t<b x='1 >0'>1 2 </b> </a>");
  EXPECT_EQ(mend_source("<a>", ".dae"), "<a>");
  EXPECT_EQ(mend_source("<a>  ", ".dae"), "<a>  ");
  EXPECT_EQ(mend_source("", ".dae"), "");
}

TEST(MendSource, ColladaSkinsWithoutBindShape_GetTheIdentity) {
  const std::string identity = "<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>";
  const std::string bound = "<skin source=\"#b\">\n <bind_shape_matrix>2</bind_shape_matrix></skin>";
  EXPECT_EQ(mend_source("<a><skin source=\"#a\"><j/></skin>" + bound + "<skin x=\"\"></skin></a>", ".dae"),
            "<a><skin source=\"#a\">" + identity + "<j/></skin>" + bound + "<skin x=\"\">" + identity + "</skin></a>");
  for (const char* text : {"<skin ", "<skin x", "<skin />", "<skins>", "<skin "}) {
    EXPECT_EQ(mend_source(text, ".dae"), text);
  }
}

TEST(MendSource, OtherFormats_Stay) {
  EXPECT_EQ(mend_source("<a>  1</a>", ".x"), "<a>  1</a>");
  EXPECT_EQ(mend_source("\"joints\"", ".bin"), "\"joints\"");
}

TEST(MendSource, SkinWithBinds_Stays) {
  const std::string bytes = test::make_bar().bytes();
  EXPECT_EQ(mend_source(bytes, ".glb"), bytes);
}

TEST(MendSource, BrokenDocuments_Stay) {
  for (const char* text : {"", "{", "[\"joints\"]", R"({"skins": {"joints": [0]}})", R"({"skins": [{"joints": [0]}]})",
                           R"({"skins": [7, {"joints": 3}], "buffers": [], "bufferViews": [], "accessors": []})"}) {
    EXPECT_EQ(mend_source(text, ".gltf"), text);
  }
  test::GlbFile bar = test::make_bar();
  bar.json["skins"][0].erase("inverseBindMatrices");
  const std::string bytes = bar.bytes();
  for (std::size_t length = 0; length < 30; ++length) {
    EXPECT_EQ(mend_source(bytes.substr(0, length), ".glb"), bytes.substr(0, length));
  }
}

TEST(MendSource, SkinWithoutBinds_IsImportedAsItsNodesPoseIt) {
  test::GlbFile bar = test::make_bar();
  bar.json["skins"][0].erase("inverseBindMatrices");
  const test::TemporaryFolder folder;
  const Rig rig = import_rig(folder.write("bar.glb", bar.bytes()));
  ASSERT_GE(rig.bones.size(), 3U);
  EXPECT_NEAR((rig.bones[1].bind.translation() - rig.bones[0].bind.translation()).norm(), 1.0, kFloatRounding);
  ASSERT_FALSE(rig.warnings.empty());
  EXPECT_NE(rig.warnings[0].find("has no bind matrices"), std::string::npos) << rig.warnings[0];
  // What the upper bone holds is given in its own frame, a metre higher.
  double top = 0.0;
  for (const Vector3d& vertex : rig.meshes[0].vertices) top = std::max(top, vertex.z());
  EXPECT_NEAR(top, 3.0, kFloatRounding);
}

TEST(DataUri, OfAnyLength_IsBase64) {
  const std::string prefix = "data:application/octet-stream;base64,";
  EXPECT_EQ(data_uri(""), prefix);
  EXPECT_EQ(data_uri("M"), prefix + "TQ==");
  EXPECT_EQ(data_uri("Ma"), prefix + "TWE=");
  EXPECT_EQ(data_uri("Man"), prefix + "TWFu");
  EXPECT_EQ(data_uri("\xFF\xFE\xFD\xFC"), prefix + "//79/A==");
}

/// The bar with texture coordinates of 8 bits.
test::GlbFile bar_with_byte_coordinates() {
  test::GlbFile bar = test::make_bar();
  const int accessor = test::add_shorts(bar, std::vector<std::uint16_t>(12, 0x33FF), "VEC2", 1);  // pairs 255, 51
  bar.json["accessors"][accessor]["componentType"] = 5121;
  bar.json["accessors"][accessor]["normalized"] = true;
  bar.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = accessor;
  return bar;
}

std::vector<Eigen::Vector2f> imported_coordinates(const test::GlbFile& bar) {
  const test::TemporaryFolder folder;
  return import_rig(folder.write("bar.glb", bar.bytes())).meshes.at(0).wedges.uvs;
}

TEST(MendSource, CoordinatesOf8Bits_AreThoseOfFloats) {
  const auto uvs = imported_coordinates(bar_with_byte_coordinates());
  ASSERT_EQ(uvs.size(), 12U);
  for (const auto& uv : uvs) EXPECT_LT((uv - Eigen::Vector2f(1.0F, 0.8F)).norm(), kFloatRounding);
}

TEST(MendSource, CoordinatesOf8BitsThatAreNotThere_AreTakenAway) {
  const auto damaged = [](const char* list, const char* name, const nlohmann::json& value) {
    test::GlbFile bar = bar_with_byte_coordinates();
    bar.json[list].back()[name] = value;
    return imported_coordinates(bar);
  };
  EXPECT_TRUE(damaged("accessors", "byteOffset", 1 << 20).empty());
  EXPECT_TRUE(damaged("accessors", "byteOffset", 4294967295).empty());
  EXPECT_TRUE(damaged("accessors", "byteOffset", -2).empty());
  EXPECT_TRUE(damaged("accessors", "bufferView", 99).empty());
  EXPECT_TRUE(damaged("accessors", "bufferView", nullptr).empty());
  EXPECT_TRUE(damaged("accessors", "count", 0).empty());
  EXPECT_TRUE(damaged("accessors", "sparse", nlohmann::json::object()).empty());
}

TEST(GltfCoordinates, ViewsThatLie_AreTakenAway) {
  const auto mended = [](const char* name, const nlohmann::json& value) {
    test::GlbFile bar = bar_with_byte_coordinates();
    bar.json["buffers"] = {{{"byteLength", bar.data.size()}}};
    bar.json["bufferViews"].back()[name] = value;
    nlohmann::json document = nlohmann::json::parse(bar.json.dump());
    EXPECT_TRUE(make_coordinates_floats(document, {bar.data.data(), bar.data.size()}));
    return document["meshes"][0]["primitives"][0]["attributes"].contains("TEXCOORD_0");
  };
  EXPECT_TRUE(mended("byteStride", 2));
  EXPECT_FALSE(mended("byteStride", 1));
  EXPECT_FALSE(mended("byteStride", 4294967295));
  EXPECT_FALSE(mended("byteOffset", "none"));
  EXPECT_FALSE(mended("byteOffset", 4294967295));
  EXPECT_FALSE(mended("buffer", 1));
}

TEST(GltfCoordinates, FloatsAndOddDocuments_Stay) {
  for (const char* text : {"[]", "{}", R"({"meshes": 3})", R"({"meshes": [1, {"primitives": [{"attributes": 4}]}]})",
                           R"({"meshes": [{"primitives": [{"attributes": {"TEXCOORD_0": 7}}]}]})"}) {
    nlohmann::json document = nlohmann::json::parse(text);
    EXPECT_FALSE(make_coordinates_floats(document, {})) << text;
    EXPECT_EQ(document, nlohmann::json::parse(text));
  }
}

TEST(BindUnboundSkins, Vertices_AreWhereTheirJointsPutThem) {
  SourceScene scene;
  const Affine3d a(Eigen::Translation3d(1, 0, 0));
  const Affine3d b = Eigen::Translation3d(0, 2, 0) * Affine3d(Eigen::AngleAxisd(0.5, Vector3d::UnitZ()));
  scene.nodes = {{"a", -1, a}, {"b", 0, b}};
  SourceMesh mesh;
  mesh.name = "skin";
  mesh.vertices = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  mesh.joints.resize(2);
  mesh.joints[0] = {0, Affine3d::Identity(), {{0, 0.5}, {2, 1.0}, {3, -1.0}}};
  mesh.joints[1] = {1, Affine3d::Identity(), {{1, 1.0}, {2, 3.0}}};
  scene.meshes = {mesh, mesh};
  scene.meshes[1].joints[0].offset = a;  // bound
  bind_unbound_skins(scene);
  const auto& vertices = scene.meshes[0].vertices;
  const Vector3d p(1, 1, 1);
  EXPECT_LT((vertices[0] - a * p).norm(), kRounding);
  EXPECT_LT((vertices[1] - b * p).norm(), kRounding);
  EXPECT_LT((vertices[2] - (0.25 * (a * p) + 0.75 * (b * p))).norm(), kRounding);
  EXPECT_EQ(vertices[3], p);  // none has a say
  EXPECT_TRUE((scene.meshes[0].joints[1].offset * b).isApprox(Affine3d::Identity(), kRounding));
  EXPECT_EQ(scene.meshes[1].vertices[0], p);
  EXPECT_EQ(scene.warnings.size(), 1U);
}

}  // namespace
}  // namespace layfigure::character
