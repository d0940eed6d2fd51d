#include <gtest/gtest.h>

#include <cmath>

#include "glb_fixture.h"
#include "layfigure/character/import.h"

namespace layfigure::character::test {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kFloatRounding = 1e-6;  // files hold floats
constexpr int kVertices = 12;            // of the bar
const std::string kPng = "\x89PNG\r\n\x1a\n and so on";

Rig import_bytes(const GlbFile& file) {
  const TemporaryFolder folder;
  return import_rig(folder.write("bar.glb", file.bytes()));
}

nlohmann::json& attributes(GlbFile& file) { return file.json["meshes"][0]["primitives"][0]["attributes"]; }
nlohmann::json& material(GlbFile& file) { return file.json["materials"][0]; }

/// Of each vertex (u, v) with v from the top, as glTF counts it, all different.
std::vector<float> coordinates() {
  std::vector<float> uvs;
  for (int vertex = 0; vertex < kVertices; ++vertex) {
    uvs.push_back(0.0625F * static_cast<float>(vertex));
    uvs.push_back(0.03125F * static_cast<float>(vertex));
  }
  return uvs;
}

/// Gives the bar a base colour texture, by texture coordinates of set 0, from a file.
void add_texture(GlbFile& file, const std::string& uri = "maps/my%20skin.png") {
  attributes(file)["TEXCOORD_0"] = add_floats(file, coordinates(), "VEC2", 2);
  file.json["images"].push_back({{"uri", uri}});
  file.json["textures"] = {{{"source", 0}}};
  material(file)["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
}

GlbFile textured_bar() {
  GlbFile file = make_bar();
  add_texture(file);
  return file;
}

bool has_warning(const Rig& rig, const std::string& text) {
  for (const std::string& warning : rig.warnings) {
    if (warning.find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(ImportLooks, Material_HasItsNameAndColour) {
  const Rig rig = import_bytes(make_bar());
  ASSERT_EQ(rig.materials.size(), 1U);
  EXPECT_EQ(rig.meshes.at(0).material, 0);
  EXPECT_EQ(rig.materials[0].name, "wood");
  EXPECT_LT((rig.materials[0].base_color - Vector3d(0.5, 0.25, 0.125)).norm(), kFloatRounding);
  EXPECT_EQ(rig.materials[0].opacity, 1.0);
  EXPECT_EQ(rig.materials[0].texture, "");
  EXPECT_EQ(rig.materials[0].image, -1);
  EXPECT_TRUE(rig.images.empty());
  EXPECT_TRUE(rig.meshes[0].wedges.normals.empty());
  EXPECT_TRUE(rig.meshes[0].wedges.uvs.empty());
}

TEST(ImportLooks, TextureInAFile_IsNamedAndTimesTheColour) {
  const Rig rig = import_bytes(textured_bar());
  ASSERT_EQ(rig.materials.size(), 1U);
  EXPECT_EQ(rig.materials[0].texture, "maps/my skin.png");
  EXPECT_EQ(rig.materials[0].image, -1);
  EXPECT_LT((rig.materials[0].base_color - Vector3d(0.5, 0.25, 0.125)).norm(), kFloatRounding);
  EXPECT_FALSE(rig.materials[0].texture_alpha);
  EXPECT_TRUE(rig.warnings.empty());
}

TEST(ImportLooks, TextureCoordinates_CountFromTheLowerLeftCorner) {
  const Rig rig = import_bytes(textured_bar());
  const SkinnedMesh& mesh = rig.meshes.at(0);
  ASSERT_EQ(mesh.wedges.uvs.size(), 12U);  // no seam: those of the vertices
  EXPECT_TRUE(mesh.wedges.triangles.empty());
  const std::vector<float> uvs = coordinates();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_LT((mesh.wedges.uvs[v] - Vector2f(uvs[2 * v], 1.0F - uvs[2 * v + 1])).norm(), kFloatRounding) << v;
  }
}

TEST(ImportLooks, TextureOfTheSecondSet_TakesThatSet) {
  GlbFile file = textured_bar();
  std::vector<float> second = coordinates();
  for (float& value : second) value += 0.25F;
  attributes(file)["TEXCOORD_1"] = add_floats(file, second, "VEC2", 2);
  material(file)["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1;
  EXPECT_LT((import_bytes(file).meshes.at(0).wedges.uvs.at(0) - Vector2f(0.25F, 0.75F)).norm(), kFloatRounding);
}

TEST(ImportLooks, TextureCoordinatesOf16Bits_AreThoseOfFloats) {
  GlbFile file = textured_bar();
  std::vector<std::uint16_t> shorts;
  for (const float value : coordinates()) shorts.push_back(static_cast<std::uint16_t>(std::lround(65535.0F * value)));
  const int accessor = add_shorts(file, shorts, "VEC2", 2);
  file.json["accessors"][accessor]["normalized"] = true;
  attributes(file)["TEXCOORD_0"] = accessor;
  const Rig rig = import_bytes(file);
  const Rig floats = import_bytes(textured_bar());
  ASSERT_EQ(rig.meshes.at(0).wedges.uvs.size(), 12U);
  constexpr float kShortRounding = 1.0F / 65535.0F;
  for (std::size_t k = 0; k < 12; ++k) {
    EXPECT_LT((rig.meshes[0].wedges.uvs[k] - floats.meshes[0].wedges.uvs[k]).norm(), kShortRounding) << k;
  }
}

TEST(ImportLooks, Normals_AreTurnedIntoTheWorld) {
  GlbFile file = make_bar();
  std::vector<float> normals;
  for (int vertex = 0; vertex < kVertices; ++vertex) normals.insert(normals.end(), {0.0F, 0.6F, 0.8F});
  attributes(file)["NORMAL"] = add_floats(file, normals, "VEC3", 3);
  const Rig rig = import_bytes(file);
  ASSERT_EQ(rig.meshes.at(0).wedges.normals.size(), 12U);
  for (const Vector3f& normal : rig.meshes[0].wedges.normals) {
    EXPECT_LT((normal - Vector3f(0.0F, -0.8F, 0.6F)).norm(), kFloatRounding);  // glTF: Y up, Z to the front
  }
}

TEST(ImportLooks, PictureInTheFile_IsKeptAsItIs) {
  GlbFile file = textured_bar();
  file.json["images"] = nlohmann::json::array();
  add_image(file, kPng, "image/png");
  const Rig rig = import_bytes(file);
  ASSERT_EQ(rig.images.size(), 1U);
  EXPECT_EQ(rig.images[0].format, "png");
  EXPECT_EQ(rig.images[0].bytes, kPng);
  EXPECT_EQ(rig.materials.at(0).image, 0);
  EXPECT_EQ(rig.materials[0].texture, "");
}

TEST(ImportLooks, PictureOfTwoMaterials_IsThereOnce) {
  GlbFile file = textured_bar();
  file.json["images"] = nlohmann::json::array();
  add_image(file, kPng, "image/png");
  file.json["materials"].push_back(file.json["materials"][0]);
  file.json["materials"][1]["name"] = "glass";
  file.json["meshes"][0]["primitives"].push_back(file.json["meshes"][0]["primitives"][0]);
  file.json["meshes"][0]["primitives"][1]["material"] = 1;
  const Rig rig = import_bytes(file);
  ASSERT_EQ(rig.meshes.size(), 2U);
  EXPECT_NE(rig.meshes[0].material, rig.meshes[1].material);
  ASSERT_EQ(rig.materials.size(), 2U);
  EXPECT_EQ(rig.images.size(), 1U);
  for (const Material& each : rig.materials) EXPECT_EQ(each.image, 0);
}

TEST(ImportLooks, PicturesThatAreTooLarge_AreLeftOutAndReported) {
  GlbFile file = textured_bar();
  file.json["images"] = nlohmann::json::array();
  add_image(file, kPng + std::string(kMostImageBytes, 'x'), "image/png");
  const Rig rig = import_bytes(file);
  EXPECT_TRUE(rig.images.empty());
  EXPECT_EQ(rig.materials.at(0).image, -1);
  EXPECT_TRUE(has_warning(rig, "more than 32 MB of pictures"));
}

TEST(ImportLooks, TextureThatIsMoved_IsReported) {
  GlbFile file = textured_bar();
  file.json["extensionsUsed"] = {"KHR_texture_transform"};
  material(file)["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = {
      {"KHR_texture_transform", {{"offset", {0.0, 0.0}}, {"scale", {1.0, 1.0}}}}};
  EXPECT_TRUE(import_bytes(file).warnings.empty());
  material(file)["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = {
      {"KHR_texture_transform", {{"offset", {0.5, 0.0}}, {"scale", {1.0, 1.0}}}}};
  EXPECT_TRUE(has_warning(import_bytes(file), "'wood' moves, turns or scales its texture"));
}

TEST(ImportLooks, VertexColours_AreReported) {
  GlbFile file = make_bar();
  attributes(file)["COLOR_0"] = add_floats(file, std::vector<float>(4 * kVertices, 0.5F), "VEC4", 4);
  EXPECT_TRUE(has_warning(import_bytes(file), "has vertex colours: left out"));
}

TEST(ImportLooks, AlphaOfAGltf_CountsWhereItSaysSo) {
  GlbFile file = textured_bar();
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1.0, 1.0, 1.0, 0.5};
  EXPECT_EQ(import_bytes(file).materials.at(0).opacity, 1.0);
  material(file)["alphaMode"] = "BLEND";
  const Material blended = import_bytes(file).materials.at(0);
  EXPECT_EQ(blended.opacity, 0.5);
  EXPECT_TRUE(blended.texture_alpha);
  EXPECT_EQ(blended.alpha_cutoff, 0.0);
  material(file)["alphaMode"] = "MASK";
  material(file)["alphaCutoff"] = 0.25;
  EXPECT_EQ(import_bytes(file).materials.at(0).alpha_cutoff, 0.25);
}

TEST(ImportLooks, WrapOfAGltf_IsItsSampler) {
  GlbFile file = textured_bar();
  EXPECT_EQ(import_bytes(file).materials.at(0).wrap[0], Wrap::kRepeat);
  file.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};  // CLAMP_TO_EDGE, MIRRORED_REPEAT
  file.json["textures"][0]["sampler"] = 0;
  const Material wood = import_bytes(file).materials.at(0);
  EXPECT_EQ(wood.wrap[0], Wrap::kClamp);
  EXPECT_EQ(wood.wrap[1], Wrap::kMirror);
}

TEST(ImportLooks, SourceFolder_IsAbsolute) {
  const TemporaryFolder folder;
  folder.write("bar.glb", make_bar().bytes());
  EXPECT_EQ(import_rig(folder.path() / "bar.glb").source_folder, folder.path().string());
}

}  // namespace
}  // namespace layfigure::character::test
