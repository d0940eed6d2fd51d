#include "glb_fixture.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <fstream>

namespace layfigure::character::test {
namespace {

using Json = nlohmann::json;

constexpr int kFloat = 5126;
constexpr int kUnsignedShort = 5123;

template <class T>
void add_accessor(GlbFile& file, const std::vector<T>& values, const char* type, int components, int component_type) {
  const std::size_t offset = file.data.size();
  file.data.resize(offset + values.size() * sizeof(T));
  std::memcpy(file.data.data() + offset, values.data(), values.size() * sizeof(T));
  while (file.data.size() % 4 != 0) file.data.push_back('\0');
  file.json["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", values.size() * sizeof(T)}});
  file.json["accessors"].push_back({{"bufferView", file.json["bufferViews"].size() - 1},
                                    {"componentType", component_type},
                                    {"count", values.size() / components},
                                    {"type", type}});
}

/// Three rings of four corners at y = 0, 1, 2, and the two ends.
void add_mesh(GlbFile& file) {
  std::vector<float> positions;
  std::vector<std::uint16_t> joints;
  std::vector<float> weights;
  for (int ring = 0; ring < 3; ++ring) {
    for (int corner = 0; corner < 4; ++corner) {
      const float x = corner == 0 || corner == 3 ? 0.1F : -0.1F;
      const float z = corner < 2 ? 0.1F : -0.1F;
      positions.insert(positions.end(), {x, static_cast<float>(ring), z});
      joints.insert(joints.end(), {0, 1, 0, 0});
      const float high = 0.5F * static_cast<float>(ring);
      weights.insert(weights.end(), {1.0F - high, high, 0.0F, 0.0F});
    }
  }
  std::vector<std::uint16_t> indices{0, 1, 2, 0, 2, 3, 8, 10, 9, 8, 11, 10};
  for (int ring = 0; ring < 2; ++ring) {
    for (int corner = 0; corner < 4; ++corner) {
      const auto a = static_cast<std::uint16_t>(4 * ring + corner);
      const auto b = static_cast<std::uint16_t>(4 * ring + (corner + 1) % 4);
      const auto above = [](std::uint16_t v) { return static_cast<std::uint16_t>(v + 4); };
      indices.insert(indices.end(), {a, above(a), b, b, above(a), above(b)});
    }
  }
  add_accessor(file, positions, "VEC3", 3, kFloat);
  add_accessor(file, indices, "SCALAR", 1, kUnsignedShort);
  add_accessor(file, joints, "VEC4", 4, kUnsignedShort);
  add_accessor(file, weights, "VEC4", 4, kFloat);
  file.json["accessors"][kPositions]["min"] = {-0.1, 0.0, -0.1};
  file.json["accessors"][kPositions]["max"] = {0.1, 2.0, 0.1};
}

void add_inverse_binds(GlbFile& file) {
  std::vector<float> matrices;
  for (int bone = 0; bone < 3; ++bone) {
    const auto y = -static_cast<float>(bone);
    matrices.insert(matrices.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, y, 0, 1});  // column-major
  }
  add_accessor(file, matrices, "MAT4", 16, kFloat);
}

void append_chunk(std::string& out, const std::string& bytes, std::uint32_t type) {
  const auto length = static_cast<std::uint32_t>(bytes.size());
  out.append(reinterpret_cast<const char*>(&length), 4).append(reinterpret_cast<const char*>(&type), 4).append(bytes);
}

}  // namespace

int add_floats(GlbFile& file, const std::vector<float>& values, const char* type, int components) {
  add_accessor(file, values, type, components, kFloat);
  return static_cast<int>(file.json["accessors"].size()) - 1;
}

int add_shorts(GlbFile& file, const std::vector<std::uint16_t>& values, const char* type, int components) {
  add_accessor(file, values, type, components, kUnsignedShort);
  return static_cast<int>(file.json["accessors"].size()) - 1;
}

int add_image(GlbFile& file, const std::string& bytes, const std::string& mime_type) {
  const std::size_t offset = file.data.size();
  file.data.insert(file.data.end(), bytes.begin(), bytes.end());
  while (file.data.size() % 4 != 0) file.data.push_back('\0');
  file.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes.size()}});
  file.json["images"].push_back(
      {{"bufferView", file.json["bufferViews"].size() - 1}, {"mimeType", mime_type}, {"name", "eye"}});
  return static_cast<int>(file.json["images"].size()) - 1;
}

std::string GlbFile::bytes() const {
  Json complete = json;
  complete["buffers"] = {{{"byteLength", data.size()}}};
  std::string text = complete.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string chunks;
  append_chunk(chunks, text, 0x4E4F534A);                                   // "JSON"
  append_chunk(chunks, std::string(data.begin(), data.end()), 0x004E4942);  // "BIN"
  std::string out = "glTF";
  const std::uint32_t version = 2;
  const auto length = static_cast<std::uint32_t>(chunks.size() + 12);
  out.append(reinterpret_cast<const char*>(&version), 4).append(reinterpret_cast<const char*>(&length), 4);
  return out + chunks;
}

void GlbFile::set_float(int accessor, int index, float value) {
  const std::size_t offset = json["bufferViews"][accessor]["byteOffset"];
  std::memcpy(data.data() + offset + 4 * static_cast<std::size_t>(index), &value, 4);
}

GlbFile make_bar() {
  GlbFile file;
  file.json = Json::parse(R"({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 4]}],
    "nodes": [{"name": "armature", "children": [1]},
              {"name": "low", "children": [2]},
              {"name": "high", "translation": [0, 1, 0], "children": [3]},
              {"name": "tip", "translation": [0, 1, 0]},
              {"name": "bar", "mesh": 0, "skin": 0}],
    "meshes": [{"name": "bar", "primitives": [
      {"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1, "material": 0}]}],
    "materials": [{"name": "wood", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1]}}],
    "skins": [{"joints": [1, 2, 3], "inverseBindMatrices": 4}]})");
  add_mesh(file);
  add_inverse_binds(file);
  return file;
}

TemporaryFolder::TemporaryFolder() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  path_ = std::filesystem::temp_directory_path() /
          (std::string(test->test_suite_name()) + "_" + test->name() + "_" + std::to_string(::getpid()));
  std::filesystem::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

std::filesystem::path TemporaryFolder::write(const std::string& name, const std::string& bytes) const {
  const std::filesystem::path file = path_ / name;
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

}  // namespace layfigure::character::test
