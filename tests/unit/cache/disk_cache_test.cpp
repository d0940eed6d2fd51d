#include "layfigure/cache/disk_cache.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>
#include <vector>

namespace layfigure::cache {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const Digest kKey{1, 2};

class DiskCacheTest : public testing::Test {
 protected:
  DiskCacheTest() : folder_(fs::temp_directory_path() / ("layfigure-cache-test-" + std::to_string(::getpid()))) {
    fs::remove_all(folder_);
  }
  ~DiskCacheTest() override { fs::remove_all(folder_); }

  [[nodiscard]] std::vector<fs::path> files() const {
    std::vector<fs::path> result;
    if (!fs::exists(folder_)) return result;
    for (const auto& file : fs::directory_iterator(folder_)) result.push_back(file.path());
    return result;
  }

  void overwrite(const std::string& bytes, std::streamoff at) const {
    std::fstream file(files().front(), std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(at);
    file << bytes;
  }

  fs::path folder_;
};

TEST_F(DiskCacheTest, Stored_IsFound) {
  const DiskCache cache(folder_);
  EXPECT_EQ(cache.find("rig", kKey), std::nullopt);
  cache.store("rig", kKey, std::string("a\0b", 3));
  EXPECT_EQ(cache.find("rig", kKey), std::string("a\0b", 3));
  EXPECT_EQ(cache.find("doll", kKey), std::nullopt);
  EXPECT_EQ(cache.find("rig", {1, 3}), std::nullopt);
  EXPECT_EQ(files().size(), 1U);
}

TEST_F(DiskCacheTest, StoredAgain_IsReplaced) {
  const DiskCache cache(folder_);
  cache.store("rig", kKey, "old");
  cache.store("rig", kKey, "new");
  EXPECT_EQ(cache.find("rig", kKey), "new");
}

TEST_F(DiskCacheTest, OtherObject_FindsTheSame) {
  DiskCache(folder_).store("rig", kKey, "bytes");
  EXPECT_EQ(DiskCache(folder_).find("rig", kKey), "bytes");
}

TEST_F(DiskCacheTest, EveryByteChanged_IsNotFoundAndGoes) {
  const DiskCache cache(folder_);
  cache.store("rig", kKey, "payload");
  const auto size = static_cast<std::streamoff>(fs::file_size(files().front()));
  for (std::streamoff at = 0; at < size; ++at) {
    cache.store("rig", kKey, "payload");
    overwrite("\xF5", at);
    EXPECT_EQ(cache.find("rig", kKey), std::nullopt) << at;
    EXPECT_TRUE(files().empty()) << at;
  }
}

TEST_F(DiskCacheTest, CutAtEveryLength_IsNotFound) {
  const DiskCache cache(folder_);
  cache.store("rig", kKey, "payload");
  for (auto length = fs::file_size(files().front()); length-- > 0;) {
    cache.store("rig", kKey, "payload");
    fs::resize_file(files().front(), length);
    EXPECT_EQ(cache.find("rig", kKey), std::nullopt) << length;
  }
}

TEST_F(DiskCacheTest, MoreThanTheBound_TheLongestUnusedGo) {
  constexpr std::uintmax_t kBound = 1000;
  const std::string bytes(200, 'x');
  const DiskCache cache(folder_, kBound);
  for (std::uint64_t k = 0; k < 4; ++k) {
    cache.store("rig", {k, 0}, bytes);
    std::this_thread::sleep_for(20ms);  // file times are no finer than some milliseconds
  }
  EXPECT_NE(cache.find("rig", {0, 0}), std::nullopt);  // used: now the newest
  std::this_thread::sleep_for(20ms);
  cache.store("rig", {4, 0}, bytes);
  EXPECT_NE(cache.find("rig", {0, 0}), std::nullopt);
  EXPECT_EQ(cache.find("rig", {1, 0}), std::nullopt);
  EXPECT_NE(cache.find("rig", {4, 0}), std::nullopt);
  std::uintmax_t total = 0;
  for (const auto& file : files()) total += fs::file_size(file);
  EXPECT_LE(total, kBound);
}

TEST_F(DiskCacheTest, EntryOfMoreThanAQuarter_IsNotKept) {
  const DiskCache cache(folder_, 1000);
  cache.store("rig", kKey, std::string(251, 'x'));
  EXPECT_EQ(cache.find("rig", kKey), std::nullopt);
}

TEST_F(DiskCacheTest, FolderThatCannotBe_IsNoError) {
  std::ofstream(folder_) << "a file";
  const DiskCache cache(folder_);
  cache.store("rig", kKey, "bytes");
  EXPECT_EQ(cache.find("rig", kKey), std::nullopt);
}

TEST_F(DiskCacheTest, ReadOnlyFolder_IsReadAndNotWritten) {
  const DiskCache cache(folder_);
  cache.store("rig", kKey, "bytes");
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_EQ(cache.find("rig", kKey), "bytes");
  cache.store("rig", {5, 5}, "more");  // root may write all the same
  fs::permissions(folder_, fs::perms::owner_all);
  EXPECT_EQ(cache.find("rig", kKey), "bytes");
}

TEST_F(DiskCacheTest, FullDisk_LeavesNothingBehind) {
  const DiskCache cache("/dev/full");  // every write below it fails
  cache.store("rig", kKey, "bytes");
  EXPECT_EQ(cache.find("rig", kKey), std::nullopt);
}

TEST_F(DiskCacheTest, SeveralProcesses_EachFindsAWholeEntry) {
  const std::string bytes(100'000, 'z');
  std::vector<pid_t> children;
  for (int k = 0; k < 4; ++k) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const DiskCache cache(folder_);
      bool whole = true;
      for (int round = 0; round < 50; ++round) {
        cache.store("rig", kKey, bytes);
        const auto found = cache.find("rig", kKey);
        whole = whole && found == bytes;
      }
      ::_exit(whole ? 0 : 1);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  EXPECT_EQ(files().size(), 1U);
}

TEST_F(DiskCacheTest, WriterThatDied_ItsFileGoesAfterAnHour) {
  const DiskCache cache(folder_);
  cache.store("rig", kKey, "bytes");
  const fs::path dead = folder_ / "rig-0.entry.abcdef.new";
  const fs::path alive = folder_ / "rig-1.entry.abcdef.new";
  std::ofstream(dead) << "half";
  std::ofstream(alive) << "half";
  fs::last_write_time(dead, fs::file_time_type::clock::now() - 2h);
  cache.store("rig", kKey, "bytes");
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_TRUE(fs::exists(alive));
}

TEST_F(DiskCacheTest, NoFolder_HoldsNothing) {
  const DiskCache cache;
  cache.store("rig", kKey, "bytes");
  EXPECT_EQ(cache.find("rig", kKey), std::nullopt);
}

TEST_F(DiskCacheTest, OfUser_IsBelowXdgCacheHomeElseHome) {
  ::setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  DiskCache::of_user().store("rig", kKey, "bytes");
  EXPECT_TRUE(fs::is_directory(folder_ / "layfigure"));
  fs::remove_all(folder_);
  ::setenv("XDG_CACHE_HOME", "not/absolute", 1);
  ::setenv("HOME", folder_.c_str(), 1);
  DiskCache::of_user().store("rig", kKey, "bytes");
  EXPECT_TRUE(fs::is_directory(folder_ / ".cache/layfigure"));
}

}  // namespace
}  // namespace layfigure::cache
