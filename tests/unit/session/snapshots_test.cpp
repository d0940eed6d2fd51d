#include "layfigure/session/snapshots.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "layfigure/cache/bytes.h"
#include "layfigure/haptics/hands.h"
#include "small_doll.h"

namespace layfigure::session {
namespace {

namespace fs = std::filesystem;

class Snapshot : public ::testing::Test {
 protected:
  Snapshot() : folder_(fs::temp_directory_path() / ("layfigure_snapshots_" + std::to_string(getpid()))) {}
  ~Snapshot() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path file() const { return folder_ / "a" / "of.snapshots"; }
  void damage(std::size_t at) const {
    std::fstream stream(file(), std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(static_cast<std::streamoff>(at));
    stream.put('?');
  }

  fs::path folder_;
  haptics::Hands hands_{testing::small_doll(), 1e-3};
  SnapshotFile snapshots_{hands_.doll(), file()};
};

TEST_F(Snapshot, Saved_IsFoundByAnotherServer_BitForBit) {
  hands_.pin({.bone = 2});
  snapshots_.save("\xC3\xA4 b/../c", hands_.memory());
  SnapshotFile other(hands_.doll(), file());
  EXPECT_EQ(other.names(), std::vector<std::string>{"\xC3\xA4 b/../c"});
  const auto found = other.find("\xC3\xA4 b/../c");
  ASSERT_TRUE(found);
  EXPECT_EQ(cache::to_bytes(*found), cache::to_bytes(hands_.memory()));
}

TEST_F(Snapshot, TwoServers_KeepEachOthers) {
  SnapshotFile other(hands_.doll(), file());
  snapshots_.save("a", hands_.memory());
  other.save("b", hands_.memory());
  snapshots_.save("c", hands_.memory());
  EXPECT_EQ(other.names(), (std::vector<std::string>{"a", "b", "c"}));
}

TEST_F(Snapshot, NoFile_IsNone) {
  EXPECT_TRUE(snapshots_.names().empty());
  EXPECT_FALSE(snapshots_.find("a"));
  EXPECT_FALSE(snapshots_.remove("a"));
}

TEST_F(Snapshot, DamagedAnywhere_RefusedAndNotWrittenOver) {
  snapshots_.save("a", hands_.memory());
  const auto size = static_cast<std::size_t>(fs::file_size(file()));
  for (const std::size_t at : {std::size_t{0}, std::size_t{12}, size / 2, size - 1}) {
    fs::remove_all(folder_);
    snapshots_.save("a", hands_.memory());
    damage(at);
    EXPECT_THROW((void)snapshots_.names(), SnapshotError) << at;
    EXPECT_THROW(snapshots_.save("b", hands_.memory()), SnapshotError) << at;
  }
  fs::resize_file(file(), size / 2);
  EXPECT_THROW((void)snapshots_.find("a"), SnapshotError);
}

TEST_F(Snapshot, OfOtherBodies_RefusedInOneLine) {
  snapshots_.save("a", hands_.memory());
  doll::Doll other = testing::small_doll();
  other.definition.bodies[2].name = "leg";
  SnapshotFile its(other, file());
  try {
    (void)its.names();
    FAIL();
  } catch (const SnapshotError& error) {
    EXPECT_NE(std::string(error.what()).find("other bodies"), std::string::npos) << error.what();
  }
}

TEST_F(Snapshot, FolderThatCannotBeWritten_SaysSo) {
  std::ofstream(folder_.string()) << "a file where the folder should be";
  EXPECT_THROW(snapshots_.save("a", hands_.memory()), SnapshotError);
}

TEST_F(Snapshot, TooMany_Refused) {
  for (std::size_t k = 0; k < Snapshots::kMost; ++k) snapshots_.save(std::to_string(k), {});
  EXPECT_THROW(snapshots_.save("one more", {}), SnapshotError);
  snapshots_.save("7", {});
}

}  // namespace
}  // namespace layfigure::session
