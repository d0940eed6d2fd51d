#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "folder_io.h"
#include "glb_fixture.h"
#include "layfigure/character/import.h"

// A character's file may name others, but none outside its folder.
namespace layfigure::character::test {
namespace {

namespace fs = std::filesystem;

/// Text glTF whose buffer is the file that `uri` names.
std::string gltf_with_buffer(const std::string& uri) {
  GlbFile glb = make_bar();
  glb.json["buffers"] = {{{"byteLength", glb.data.size()}, {"uri", uri}}};
  return glb.json.dump();
}

std::string bar_data() {
  const GlbFile glb = make_bar();
  return {glb.data.begin(), glb.data.end()};
}

bool is_refused(const fs::path& file) {
  try {
    (void)import_rig(file);
    return false;
  } catch (const ImportError& error) {
    EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos) << error.what();
    return true;
  }
}

TEST(ImportRig, BufferInTheFolderOrBelow_IsRead) {
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "data");
  folder.write("bar.bin", bar_data());
  folder.write("data/bar.bin", bar_data());
  for (const char* uri : {"bar.bin", "data/bar.bin", "data/../bar.bin", "./bar.bin"}) {
    EXPECT_FALSE(is_refused(folder.write("bar.gltf", gltf_with_buffer(uri)))) << uri;
  }
}

TEST(ImportRig, BufferOutsideTheFolder_IsRefusedThoughItIsThere) {
  const TemporaryFolder folder;
  const fs::path inside = folder.path() / "inside";
  fs::create_directory(inside);
  const fs::path outside = folder.write("bar.bin", bar_data());
  fs::create_symlink(outside, inside / "link.bin");
  fs::create_directory_symlink(folder.path(), inside / "up");
  for (const std::string& uri : {std::string("../bar.bin"), outside.string(), "file://" + outside.string(),
                                 std::string("link.bin"), std::string("up/bar.bin"), std::string("%2e%2e/bar.bin"),
                                 std::string("..\\bar.bin"), std::string("../../../../../../etc/passwd")}) {
    EXPECT_TRUE(is_refused(folder.write("inside/bar.gltf", gltf_with_buffer(uri)))) << uri;
  }
}

TEST(ImportRig, BufferThatIsNoRegularFile_IsRefusedAtOnce) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder.path() / "pipe.bin").c_str(), 0600), 0);  // reading it would wait for ever
  fs::create_directory(folder.path() / "folder.bin");
  for (const char* uri : {"pipe.bin", "folder.bin", "missing.bin"}) {
    EXPECT_TRUE(is_refused(folder.write("bar.gltf", gltf_with_buffer(uri)))) << uri;
  }
}

TEST(ImportRig, CharacterBehindALink_IsRead) {
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "elsewhere");
  const fs::path real = folder.write("elsewhere/bar.glb", make_bar().bytes());
  fs::create_symlink(real, folder.path() / "link.glb");
  EXPECT_FALSE(is_refused(folder.path() / "link.glb"));
}

TEST(ImportRig, PathInTheWorkingFolder_IsRead) {
  const TemporaryFolder folder;
  folder.write("bar.bin", bar_data());
  folder.write("bar.gltf", gltf_with_buffer("bar.bin"));
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  EXPECT_FALSE(is_refused("bar.gltf"));
  fs::current_path(before);
}

TEST(FolderIo, FilesThatWereAskedFor_AreCompanions) {
  const TemporaryFolder folder;
  const fs::path character = folder.write("bar.gltf", "character");
  folder.write("read.bin", "bytes");
  folder.write("seen.png", "picture");
  FolderIo io(character);
  for (const char* name : {"bar.gltf", "read.bin"}) {
    Assimp::IOStream* stream = io.Open((folder.path() / name).c_str(), "rb");
    ASSERT_NE(stream, nullptr);
    io.Close(stream);
  }
  EXPECT_TRUE(io.Exists((folder.path() / "seen.png").c_str()));
  EXPECT_FALSE(io.Exists((folder.path() / "missing.mtl").c_str()));
  EXPECT_FALSE(io.Exists("/etc/passwd"));
  EXPECT_EQ(io.Open((folder.path() / "new.bin").c_str(), "wb"), nullptr);
  EXPECT_EQ(io.character_digest(), cache::digest_of("character"));
  const std::vector<Companion> companions = io.companions();
  ASSERT_EQ(companions.size(), 3U);
  EXPECT_EQ(companions[0].path, "missing.mtl");
  EXPECT_EQ(companions[0].use, Companion::Use::kAbsent);
  EXPECT_EQ(companions[1].path, "read.bin");
  EXPECT_EQ(companions[1].use, Companion::Use::kRead);
  EXPECT_EQ(companions[1].digest, cache::digest_of("bytes"));
  EXPECT_EQ(companions[2].path, "seen.png");
  EXPECT_EQ(companions[2].use, Companion::Use::kSeen);
  for (const Companion& companion : companions) EXPECT_TRUE(is_unchanged(companion, folder.path())) << companion.path;
  folder.write("read.bin", "other");
  folder.write("missing.mtl", "here now");
  fs::remove(folder.path() / "seen.png");
  for (const Companion& companion : companions) EXPECT_FALSE(is_unchanged(companion, folder.path())) << companion.path;
}

}  // namespace
}  // namespace layfigure::character::test
