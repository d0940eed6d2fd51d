#include "layfigure/doll/cached_build.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "layfigure/cache/bytes.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

namespace fs = std::filesystem;

class CachedBuild : public testing::Test {
 protected:
  ~CachedBuild() override { fs::remove_all(folder_); }
  [[nodiscard]] std::size_t entries() const {
    const auto files = fs::directory_iterator(folder_);
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
  }

  fs::path folder_{fs::temp_directory_path() / ("layfigure-doll-cache-" + std::to_string(::getpid()))};
  cache::DiskCache cache_{folder_};
};

TEST_F(CachedBuild, SecondTime_TheDollIsTheSameToTheBit) {
  const std::string fresh = cache::to_bytes(build_doll(test::make_adult()));
  EXPECT_EQ(cache::to_bytes(build_doll(test::make_adult(), {}, cache_)), fresh);
  EXPECT_EQ(entries(), 1U);
  EXPECT_EQ(cache::to_bytes(build_doll(test::make_adult(), {}, cache_)), fresh);
  EXPECT_EQ(entries(), 1U);
}

TEST_F(CachedBuild, OtherSettings_AreAnotherDoll) {
  (void)build_doll(test::make_adult(), {}, cache_);
  DollSettings heavy;
  heavy.density *= 2.0;
  const Doll doll = build_doll(test::make_adult(), heavy, cache_);
  EXPECT_EQ(cache::to_bytes(doll), cache::to_bytes(build_doll(test::make_adult(), heavy)));
  EXPECT_EQ(entries(), 2U);
}

TEST_F(CachedBuild, OtherOverridesOrTotalMass_AreAnotherDoll) {
  (void)build_doll(test::make_adult(), {}, cache_);
  DollSettings settings;
  settings.total_mass = Entry<double>{12.0, 1};
  (void)build_doll(test::make_adult(), settings, cache_);
  for (const double stiffness : {5.0, 6.0}) {
    settings.joints = {{.pattern = "left1", .line = 2, .stiffness = Entry<Amount>{{stiffness, false}, 3}}};
    (void)build_doll(test::make_adult(), settings, cache_);
    const Doll doll = build_doll(test::make_adult(), settings, cache_);
    EXPECT_EQ(cache::to_bytes(doll), cache::to_bytes(build_doll(test::make_adult(), settings)));
  }
  EXPECT_EQ(entries(), 4U);
}

TEST_F(CachedBuild, SettingsOutOfRange_ThrowAndLeaveNoEntry) {
  DollSettings wrong;
  wrong.density = -1.0;
  EXPECT_THROW((void)build_doll(test::make_adult(), wrong, cache_), std::invalid_argument);
  EXPECT_FALSE(fs::exists(folder_));
}

}  // namespace
}  // namespace layfigure::doll
