// Random scenes over the whole range that the solver is held to, in shards of fixed seeds. LAYFIGURE_STRESS_SCENES=N
// runs N of them instead of 100 000. A scene that fails is written, as small as it could be made, to
// stress-<seed>.json; LAYFIGURE_STRESS_FILE=stress-<seed>.json runs it again.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "random_scene.h"
#include "scene_file.h"
#include "stress_run.h"

namespace layfigure::testing {
namespace {

constexpr int kScenes = 100000;
constexpr int kShards = 10;
constexpr int kReported = 5;
// In scenes whose energies lie far beyond what their steps resolve, rounding may keep Newton's method from its
// tolerance. Such a step is finite and reported as not converged; it must stay a rarity.
constexpr double kUnconvergedShare = 1e-3;

int scenes_per_shard() {
  const char* asked = std::getenv("LAYFIGURE_STRESS_SCENES");
  return ((asked == nullptr ? kScenes : std::atoi(asked)) + kShards - 1) / kShards;
}

class Stress : public ::testing::TestWithParam<int> {};

TEST_P(Stress, RandomScenes_KeepEveryPromise) {
  const int scenes = scenes_per_shard();
  int unconverged = 0;
  int unsolved = 0;
  int failed = 0;
  for (int seed = GetParam() * scenes; seed < (GetParam() + 1) * scenes && failed < kReported; ++seed) {
    const StressScene scene = random_scene(seed);
    const StressOutcome outcome = run(scene);
    unconverged += outcome.unconverged > 0 ? 1 : 0;
    unsolved += outcome.unsolved > 0 ? 1 : 0;
    if (outcome.failure.empty()) continue;
    ++failed;
    const std::string path = "stress-" + std::to_string(seed) + ".json";
    const StressScene small = shrink(scene);
    write_scene(small, run(small).failure, path);
    ADD_FAILURE() << "seed " << seed << ": " << outcome.failure << "; see " << path;
  }
  EXPECT_LE(unconverged, kUnconvergedShare * scenes + 1);
  RecordProperty("unconverged", unconverged);
  RecordProperty("unsolved", unsolved);
}

INSTANTIATE_TEST_SUITE_P(Shard, Stress, ::testing::Range(0, kShards));

TEST(StressFile, Named_KeepsEveryPromise) {
  const char* path = std::getenv("LAYFIGURE_STRESS_FILE");
  if (path == nullptr) GTEST_SKIP() << "LAYFIGURE_STRESS_FILE names no scene";
  EXPECT_EQ(run(read_scene(path)).failure, "");
}

/// A scene made to fail: a load that is not a number.
StressScene failing_scene() {
  StressScene scene = random_scene(3);
  scene.forces[0].force.x() = std::numeric_limits<double>::quiet_NaN();
  return scene;
}

TEST(StressFile, Shrink_KeepsTheFailure) {
  ASSERT_FALSE(run(failing_scene()).failure.empty());
  const StressScene small = shrink(failing_scene());
  EXPECT_FALSE(run(small).failure.empty());
  EXPECT_EQ(small.definition.model.bodies.size(), 1);
  EXPECT_EQ(small.steps, 1);
}

TEST(StressFile, WrittenAndRead_IsTheSameScene) {
  const std::string first = ::testing::TempDir() + "stress-first.json";
  const std::string second = ::testing::TempDir() + "stress-second.json";
  const auto text = [](const std::string& path) {
    std::ifstream in(path);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  for (int seed = 0; seed < 50; ++seed) {
    const StressScene scene = seed == 0 ? failing_scene() : random_scene(seed);
    write_scene(scene, "", first);
    const StressScene read = read_scene(first);
    write_scene(read, "", second);
    EXPECT_GT(text(first).size(), 1000);
    EXPECT_EQ(text(first), text(second));
    EXPECT_EQ(run(read).failure, run(scene).failure);
  }
  std::filesystem::remove(first);
  std::filesystem::remove(second);
}

TEST(StressFile, ThatIsNone_IsRefusedByName) {
  EXPECT_THROW((void)read_scene("no-such-file.json"), std::runtime_error);
  const std::string path = ::testing::TempDir() + "stress-bad.json";
  std::ofstream(path) << R"({"fails": "", "seed": 1, "h": "soon"})";
  try {
    (void)read_scene(path);
    ADD_FAILURE() << "it must be refused";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("h: 'soon'"), std::string::npos) << error.what();
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace layfigure::testing
