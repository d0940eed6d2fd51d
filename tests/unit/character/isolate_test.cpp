#include "isolate.h"

#include <gtest/gtest.h>

#include <csignal>
#include <stdexcept>

#include "rig_bytes.h"

namespace layfigure::character {
namespace {

std::string failure(const std::function<std::string()>& work) {
  try {
    return "returned " + run_isolated(work);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(RunIsolated, Work_ReturnsItsBytes) {
  const std::string large(1 << 20, 'x');  // more than a pipe holds
  EXPECT_EQ(run_isolated([&] { return large + '\0' + large; }), large + '\0' + large);
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

TEST(RigBytes, Rig_ComesBackEqual) {
  Rig rig;
  rig.name = "somebody";
  rig.bones.resize(2);
  rig.bones[1].name = "arm";
  rig.bones[1].parent = 0;
  rig.bones[1].bind.translation() = Eigen::Vector3d(1, 2, 3);
  SkinnedMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.influences = {{{0, 1.0}}, {{1, 0.5}, {0, 0.5}}, {{1, 1.0}}};
  rig.meshes = {mesh};
  rig.warnings = {"a warning"};
  rig.content_hash = 42;
  const std::string bytes = to_bytes(rig);
  const Rig back = from_bytes(bytes);
  EXPECT_EQ(to_bytes(back), bytes);
  EXPECT_EQ(back.bones[1].name, "arm");
  EXPECT_EQ(back.bones[1].bind.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(back.meshes[0].influences[1][1].weight, 0.5);
  EXPECT_EQ(back.content_hash, 42U);
}

TEST(RigBytes, BytesCutShort_AreRefused) {
  Rig rig;
  rig.name = "somebody";
  rig.bones.resize(1);
  const std::string bytes = to_bytes(rig);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW((void)from_bytes(bytes.substr(0, length)), std::runtime_error) << length;
  }
  EXPECT_THROW((void)from_bytes(bytes + "x"), std::runtime_error);
}

}  // namespace
}  // namespace layfigure::character
