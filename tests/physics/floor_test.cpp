// Scenes with a floor, as the benchmark gives them to every engine: by our steps and by Bullet's.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "bullet_world.h"
#include "floor_scene.h"

namespace layfigure::testing {
namespace {

constexpr double kHeight = 0.05;
constexpr double kRadius = 0.02;
constexpr double kPush = 5.0;              // N
constexpr double kSinglePrecision = 5e-3;  // of Bullet's forces, relative

/// A free chain on two balls and a capsule that falls on the floor and is pushed down.
Scene falling_chain(double bend) {
  Scene scene = chain({.links = 4, .bend = bend, .damping = 0.05});
  scene.definition.root = dynamics::RootKind::kFree;
  scene.definition.bodies.front().anchor.z() = kHeight;
  scene.limbs.push_back({0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, kRadius});
  scene.limbs.push_back({1, {0.02, 0.0, 0.0}, {0.08, 0.0, 0.0}, kRadius});
  scene.limbs.push_back({3, {0.1, 0.0, 0.0}, {0.1, 0.0, 0.0}, kRadius});
  scene.pulls.push_back(
      {.body = 1, .force = {0.0, 0.0, -kPush}, .start = 0.0, .end = 2.0, .shape = Pull::Shape::kConstant});
  scene.floor = 0.5;
  scene.duration = 1.0;
  return scene;
}

double load_of(const Scene& scene) {
  double load = kPush;
  for (const auto& body : scene.definition.bodies) load += 9.81 * body.mass;
  return load;
}

TEST(Floor, FallenChain_IsCarriedByTheFloor) {
  const Scene scene = falling_chain(0.0);
  for (const int order : {1, 2}) {
    const FloorRun run = run_on_floor(scene, 1000, order);
    ASSERT_TRUE(run.result.finite);
    EXPECT_NEAR(run.touch.support, load_of(scene), 1e-2 * load_of(scene));
    EXPECT_LE(run.touch.kinetic, 1e-4);
    EXPECT_LE(run.touch.penetration, 2e-3);
    EXPECT_LT(run.result.coms[1].z(), kHeight - 0.01) << "it fell";
  }
}

TEST(Floor, FallenChain_IsCarriedInBulletToo) {
  const Scene scene = falling_chain(0.0);
  for (const BulletSolver solver : {BulletSolver::kSequentialImpulses, BulletSolver::kDantzig}) {
    const BulletResult theirs = run_bullet(scene, 5000, solver);
    ASSERT_TRUE(theirs.finite);
    EXPECT_NEAR(theirs.touch.support, load_of(scene), (1e-2 + kSinglePrecision) * load_of(scene));
    EXPECT_LE(theirs.touch.kinetic, 1e-4);
    EXPECT_LE(theirs.touch.penetration, 2e-3);
  }
}

TEST(Floor, ChainStillInTheAir_AgreesWithBullet) {
  Scene scene = falling_chain(0.3);
  scene.definition.bodies.front().anchor.z() = 5.0;
  scene.duration = 0.25;
  const RunResult ours = run_on_floor(scene, 1000, 2).result;
  const BulletResult theirs = run_bullet(scene, 2500);
  for (std::size_t i = 0; i < ours.coms.size(); ++i) {
    EXPECT_LE((ours.coms[i] - theirs.coms[i]).norm(), 2e-3) << "link " << i;
    EXPECT_LT(ours.coms[i].z(), 4.8) << "it fell";
  }
  EXPECT_EQ(theirs.touch.support, 0.0);
  EXPECT_EQ(theirs.touch.penetration, 0.0);
}

TEST(Floor, Penetration_IsThatOfTheDeepestLimb) {
  const Scene scene = falling_chain(0.0);
  std::vector<dynamics::BodyPose> poses;
  const dynamics::Model model(scene.definition);
  dynamics::State state = dynamics::initial_state(model);
  dynamics::world_poses(model, state, poses);
  EXPECT_EQ(penetration(scene, poses), 0.0);
  poses[3].origin.z() = kRadius - 0.004;
  EXPECT_NEAR(penetration(scene, poses), 0.004, 1e-12);
}

/// A scene file with a floor, changed.
std::string file_with(const char* key, const nlohmann::json& value) {
  const std::string path = ::testing::TempDir() + "floor-scene.json";
  const nlohmann::json body{{"parent", -1}, {"anchor", {0, 0, 1}}, {"com", {0, 0, 0}}, {"mass", 1}, {"K", 1}, {"D", 1}};
  nlohmann::json scene{
      {"name", "floor"}, {"gravity", {0, 0, -10}}, {"bodies", {body}}, {"root", "free"}, {"floor", 0.3}};
  scene["bodies"][0]["inertia"] = {1, 1, 1};
  scene["bodies"][0]["quat0"] = {1, 0, 0, 0};
  scene["limbs"] = {{{"body", 0}, {"from", {0, 0, 0}}, {"to", {1, 0, 0}}, {"radius", 0.1}}};
  scene[key] = value;
  std::ofstream(path) << scene;
  return path;
}

TEST(Floor, SceneFile_IsReadWithItsLimbs) {
  const Scene scene = load_scene(file_with("name", "read"));
  EXPECT_EQ(scene.name, "read");
  EXPECT_EQ(scene.definition.root, dynamics::RootKind::kFree);
  EXPECT_EQ(scene.floor, 0.3);
  ASSERT_EQ(scene.limbs.size(), 1);
  EXPECT_EQ(scene.limbs[0].to, Eigen::Vector3d::UnitX());
}

TEST(Floor, BrokenSceneFile_IsRefused) {
  EXPECT_THROW((void)load_scene(file_with("root", "loose")), std::runtime_error);
  EXPECT_THROW((void)load_scene(file_with("floor", "smooth")), std::runtime_error);
  const nlohmann::json limb{{"body", 0}, {"from", {0, 0, 0}}, {"to", {1, 0, 0}}, {"radius", 0.1}};
  for (const auto& [key, value] : {std::pair<const char*, int>{"body", 1}, {"body", -1}, {"radius", 0}}) {
    nlohmann::json broken = limb;
    broken[key] = value;
    EXPECT_THROW((void)load_scene(file_with("limbs", {broken})), std::runtime_error) << broken;
  }
}

}  // namespace
}  // namespace layfigure::testing
