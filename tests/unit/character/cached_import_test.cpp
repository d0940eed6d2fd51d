#include <gtest/gtest.h>

#include "glb_fixture.h"
#include "layfigure/character/import.h"
#include "rig_bytes.h"

namespace layfigure::character::test {
namespace {

namespace fs = std::filesystem;

class CachedImport : public testing::Test {
 protected:
  [[nodiscard]] Rig import(const std::string& name) const { return import_rig(folder_.path() / name, cache_); }
  [[nodiscard]] std::vector<fs::path> entries() const {
    std::vector<fs::path> result;
    if (!fs::exists(folder_.path() / "cache")) return result;
    for (const auto& file : fs::directory_iterator(folder_.path() / "cache")) result.push_back(file.path());
    return result;
  }
  /// Puts another rig where the only entry is, so that one can see that it is used.
  void swap_entry_for(const std::string& name) const {
    const fs::path entry = entries().at(0);
    const cache::DiskCache other(folder_.path() / "other");
    (void)import_rig(folder_.path() / name, other);
    fs::rename(fs::directory_iterator(folder_.path() / "other")->path(), entry);
  }

  TemporaryFolder folder_;
  cache::DiskCache cache_{folder_.path() / "cache"};
};

std::string bytes_of(const Rig& rig) { return to_bytes({rig, {}, {}}); }

/// The bar with its second bone renamed.
std::string renamed_bar() {
  GlbFile glb = make_bar();
  glb.json["nodes"][2]["name"] = "renamed";
  return glb.bytes();
}

TEST_F(CachedImport, SecondTime_TheSameRigComesFromTheCache) {
  folder_.write("bar.glb", make_bar().bytes());
  folder_.write("other.glb", renamed_bar());
  const Rig first = import("bar.glb");
  EXPECT_EQ(bytes_of(first), bytes_of(import_rig(folder_.path() / "bar.glb")));
  ASSERT_EQ(entries().size(), 1U);
  EXPECT_EQ(bytes_of(import("bar.glb")), bytes_of(first));
  EXPECT_EQ(entries().size(), 1U);
  swap_entry_for("other.glb");
  EXPECT_EQ(import("bar.glb").bones[1].name, "renamed");  // so it is not read anew
}

TEST_F(CachedImport, SameBytesUnderAnotherName_AreFoundAndNamedAnew) {
  folder_.write("bar.glb", make_bar().bytes());
  (void)import("bar.glb");
  folder_.write("copy.glb", make_bar().bytes());
  const Rig copy = import("copy.glb");
  EXPECT_EQ(copy.name, "copy");
  EXPECT_EQ(copy.source_file, "copy.glb");
  EXPECT_EQ(entries().size(), 1U);
}

TEST_F(CachedImport, FileChanged_IsReadAnew) {
  folder_.write("bar.glb", make_bar().bytes());
  EXPECT_EQ(import("bar.glb").bones[1].name, "high");
  folder_.write("bar.glb", renamed_bar());
  EXPECT_EQ(import("bar.glb").bones[1].name, "renamed");
}

TEST_F(CachedImport, FileBesideItChanged_IsReadAnew) {
  GlbFile glb = make_bar();
  glb.json["buffers"] = {{{"byteLength", glb.data.size()}, {"uri", "bar.bin"}}};
  folder_.write("bar.gltf", glb.json.dump());
  folder_.write("bar.bin", {glb.data.begin(), glb.data.end()});
  const Rig first = import("bar.gltf");
  EXPECT_EQ(import("bar.gltf").content_hash, first.content_hash);
  glb.set_float(kPositions, 0, 0.15F);
  folder_.write("bar.bin", {glb.data.begin(), glb.data.end()});
  EXPECT_NE(import("bar.gltf").content_hash, first.content_hash);
}

TEST_F(CachedImport, BrokenEntry_IsReplaced) {
  folder_.write("bar.glb", make_bar().bytes());
  const Rig first = import("bar.glb");
  const auto whole = fs::file_size(entries().at(0));
  fs::resize_file(entries().at(0), whole / 2);
  EXPECT_EQ(bytes_of(import("bar.glb")), bytes_of(first));
  EXPECT_EQ(fs::file_size(entries().at(0)), whole);
}

TEST_F(CachedImport, FileThatIsRefused_LeavesNoEntry) {
  folder_.write("bad.glb", make_bar().bytes().substr(0, 200));
  EXPECT_THROW((void)import("bad.glb"), ImportError);
  EXPECT_TRUE(entries().empty());
}

}  // namespace
}  // namespace layfigure::character::test
