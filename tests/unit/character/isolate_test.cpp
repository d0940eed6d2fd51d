#include "isolate.h"

#include <gtest/gtest.h>

#include <csignal>
#include <stdexcept>

#include "rig_bytes.h"

namespace layfigure::character {
namespace {

constexpr ChildLimits kLimits{60, 1ULL << 32U};

std::string failure(const std::function<std::string()>& work, const ChildLimits& limits = kLimits) {
  try {
    return "returned " + run_isolated(work, limits);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(RunIsolated, Work_ReturnsItsBytes) {
  const std::string large(1 << 20, 'x');  // more than a pipe holds
  EXPECT_EQ(run_isolated([&] { return large + '\0' + large; }, kLimits), large + '\0' + large);
}

TEST(RunIsolated, Exception_ComesThroughWithItsMessage) {
  EXPECT_EQ(failure([]() -> std::string { throw std::runtime_error("the reason"); }), "the reason");
}

TEST(RunIsolated, Crash_IsAnErrorHere) {
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS}) {
    EXPECT_NE(failure([&]() -> std::string {
                std::raise(signal);
                return "still alive";
              }).find("crashes its reader"),
              std::string::npos);
  }
}

TEST(RunIsolated, EndlessLoop_IsStopped) {
  const auto loop = []() -> std::string {
    for (volatile unsigned k = 0;; k = k + 1) {
    }
  };
  EXPECT_NE(failure(loop, {1, 1ULL << 32U}).find("was stopped"), std::string::npos);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(RunIsolated, MoreMemoryThanAllowed_SaysSo) {
  const auto eat = [] { return std::string(3ULL << 30U, 'x'); };
  EXPECT_NE(failure(eat, {60, 1ULL << 31U}).find("memory"), std::string::npos);
}
#endif

TEST(RunIsolated, EndlessRecursion_IsAnErrorHere) {
  struct Tower {
    static std::size_t climb(std::size_t level) {
      volatile char stone[4096] = {};
      stone[level % sizeof stone] = 1;
      return level == 0 ? 0 : climb(level + 1) + static_cast<std::size_t>(stone[1]);
    }
  };
  EXPECT_NE(failure([] { return std::to_string(Tower::climb(1)); }).find("crashes its reader"), std::string::npos);
}

TEST(RigBytes, Rig_ComesBackEqual) {
  Rig rig;
  rig.name = "somebody";
  rig.bones.resize(2);
  rig.bones[1].name = "arm";
  rig.bones[1].parent = 0;
  rig.bones[1].bind.translation() = Eigen::Vector3d(1, 2, 3);
  rig.bones[1].limits.emplace().upper.y() = 0.5;
  SkinnedMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.influences = {{{0, 1.0}}, {{1, 0.5}, {0, 0.5}}, {{1, 1.0}}};
  rig.meshes = {mesh};
  rig.warnings = {"a warning"};
  rig.content_hash = 42;
  ImportRecord record{rig, {{"bar.bin", Companion::Use::kRead, {7, 8}}}, cache::Digest{5, 6}};
  const std::string bytes = to_bytes(record);
  const ImportRecord copy = from_bytes(bytes);
  EXPECT_EQ(to_bytes(copy), bytes);
  EXPECT_EQ(copy.digest, (cache::Digest{5, 6}));
  ASSERT_EQ(copy.companions.size(), 1U);
  EXPECT_EQ(copy.companions[0].path, "bar.bin");
  EXPECT_EQ(copy.companions[0].use, Companion::Use::kRead);
  EXPECT_EQ(copy.companions[0].digest, (cache::Digest{7, 8}));
  const Rig& back = copy.rig;
  EXPECT_EQ(back.bones[1].name, "arm");
  EXPECT_EQ(back.bones[1].bind.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(back.bones[0].limits.has_value());
  EXPECT_EQ(back.bones[1].limits->upper.y(), 0.5);
  EXPECT_EQ(back.meshes[0].influences[1][1].weight, 0.5);
  EXPECT_EQ(back.content_hash, 42U);
}

TEST(RigBytes, BytesCutShort_AreRefused) {
  Rig rig;
  rig.name = "somebody";
  rig.bones.resize(1);
  const std::string bytes = to_bytes({rig, {}, {}});
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW((void)from_bytes(bytes.substr(0, length)), std::runtime_error) << length;
  }
  EXPECT_THROW((void)from_bytes(bytes + "x"), std::runtime_error);
}

TEST(RigBytes, IndexOutOfRange_IsRefused) {
  Rig good;
  good.bones.resize(2);
  good.bones[1].parent = 0;
  SkinnedMesh mesh;
  mesh.vertices.resize(3, Eigen::Vector3d::Zero());
  mesh.triangles = {{0, 1, 2}};
  mesh.influences.resize(3, {{1, 1.0}});
  good.meshes = {mesh};
  EXPECT_NO_THROW((void)from_bytes(to_bytes({good, {}, {}})));
  const auto expect_refused = [&](const std::function<void(Rig&)>& spoil) {
    Rig bad = good;
    spoil(bad);
    EXPECT_THROW((void)from_bytes(to_bytes({bad, {}, {}})), std::runtime_error);
  };
  expect_refused([](Rig& rig) { rig.bones[1].parent = 1; });
  expect_refused([](Rig& rig) { rig.bones[0].parent = -2; });
  expect_refused([](Rig& rig) { rig.meshes[0].triangles[0][2] = 3; });
  expect_refused([](Rig& rig) { rig.meshes[0].triangles[0][0] = -1; });
  expect_refused([](Rig& rig) { rig.meshes[0].influences[1][0].bone = 2; });
  expect_refused([](Rig& rig) { rig.meshes[0].influences[2].clear(); });
  expect_refused([](Rig& rig) { rig.meshes[0].influences.pop_back(); });
}

}  // namespace
}  // namespace layfigure::character
