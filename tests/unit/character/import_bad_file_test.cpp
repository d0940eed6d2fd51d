#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "glb_fixture.h"
#include "layfigure/character/import.h"

namespace layfigure::character::test {
namespace {

/// What import_rig says of the file; fails unless it throws an ImportError of one line that names the file.
std::string complaint(const std::filesystem::path& file) {
  try {
    (void)import_rig(file);
  } catch (const ImportError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find(file.string()), std::string::npos) << what;
    EXPECT_EQ(std::count(what.begin(), what.end(), '\n'), 0) << what;
    return what;
  }
  ADD_FAILURE() << file << " was accepted";
  return {};
}

std::string complaint_of(const GlbFile& glb) {
  const TemporaryFolder folder;
  return complaint(folder.write("bad.glb", glb.bytes()));
}

TEST(ImportRig, NoSuchFile_SaysSo) {
  const TemporaryFolder folder;
  EXPECT_NE(complaint(folder.path() / "nobody.glb").find("no such file"), std::string::npos);
}

TEST(ImportRig, Folder_SaysSo) {
  const TemporaryFolder folder;
  EXPECT_NE(complaint(folder.path()).find("folder"), std::string::npos);
}

TEST(ImportRig, EmptyFile_SaysSo) {
  const TemporaryFolder folder;
  EXPECT_NE(complaint(folder.write("empty.glb", "")).find("empty"), std::string::npos);
}

TEST(ImportRig, TextNamedGlb_SaysItIsNone) {
  const TemporaryFolder folder;
  EXPECT_NE(complaint(folder.write("poem.GLB", "a poem, not a character\n")).find("not a binary glTF"),
            std::string::npos);
}

TEST(ImportRig, UnknownFormat_IsRefused) {
  const TemporaryFolder folder;
  EXPECT_NE(complaint(folder.write("notes.txt", "nothing\n")).find("not a format that is known"), std::string::npos);
}

TEST(ImportRig, TruncatedGlb_IsRefusedAtEveryLength) {
  const TemporaryFolder folder;
  const std::string whole = make_bar().bytes();
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    complaint(folder.write("cut.glb", whole.substr(0, length)));
  }
  EXPECT_NE(complaint(folder.write("cut.glb", whole.substr(0, whole.size() - 1))).find("truncated"), std::string::npos);
}

TEST(ImportRig, NoSkin_SaysItHasNoBones) {
  GlbFile glb = make_bar();
  glb.json["nodes"][4].erase("skin");
  EXPECT_NE(complaint_of(glb).find("no bones"), std::string::npos);
}

TEST(ImportRig, NoTriangles_SaysSo) {
  GlbFile glb = make_bar();
  glb.json["accessors"][kIndices]["count"] = 0;
  EXPECT_FALSE(complaint_of(glb).empty());
  GlbFile points = make_bar();
  points.json["meshes"][0]["primitives"][0]["mode"] = 0;
  EXPECT_FALSE(complaint_of(points).empty());
}

TEST(ImportRig, VertexNotFinite_NamesTheMesh) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    GlbFile glb = make_bar();
    glb.set_float(kPositions, 4, bad);
    EXPECT_NE(complaint_of(glb).find("mesh 'bar' has a vertex that is not finite"), std::string::npos);
  }
}

TEST(ImportRig, BindWithoutInverse_NamesTheBone) {
  for (const float bad : {0.0F, std::numeric_limits<float>::quiet_NaN()}) {
    GlbFile glb = make_bar();
    for (int k = 0; k < 12; ++k) glb.set_float(kInverseBinds, 16 + k, bad);
    EXPECT_NE(complaint_of(glb).find("bone 'high'"), std::string::npos);
  }
}

TEST(ImportRig, VertexTooFarOut_SaysSo) {
  GlbFile glb = make_bar();
  glb.set_float(kPositions, 4, 1e9F);
  EXPECT_NE(complaint_of(glb).find("1e6 m"), std::string::npos);
}

TEST(ImportRig, NodeThatIsItsOwnAncestor_IsRefused) {
  GlbFile glb = make_bar();
  glb.json["nodes"][3]["children"] = {1};
  EXPECT_FALSE(complaint_of(glb).empty());
}

TEST(ImportRig, CountsBeyondTheFile_AreRefused) {
  for (const int accessor : {kPositions, kIndices, kJoints, kWeights, kInverseBinds}) {
    GlbFile glb = make_bar();
    glb.json["accessors"][accessor]["count"] = 1'000'000'000;
    EXPECT_FALSE(complaint_of(glb).empty()) << accessor;
  }
}

TEST(ImportRig, FileWithBytesChanged_IsReadOrRefusedButNeverCrashes) {
  constexpr unsigned kSeed = 20261122;
  std::mt19937 random(kSeed);
  const TemporaryFolder folder;
  const std::string whole = make_bar().bytes();
  int refused = 0;
  for (int round = 0; round < 300; ++round) {
    std::string bytes = whole;
    for (int k = 0; k < 3; ++k) bytes[20 + random() % (bytes.size() - 20)] = static_cast<char>(random());
    const auto file = folder.write("mutated.glb", bytes);
    try {
      const Rig rig = import_rig(file);
      EXPECT_FALSE(rig.bones.empty());
      for (const SkinnedMesh& mesh : rig.meshes) {
        for (const auto& vertex : mesh.vertices) EXPECT_TRUE(vertex.allFinite());
      }
    } catch (const ImportError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0) << "seed " << kSeed;
}

}  // namespace
}  // namespace layfigure::character::test
