// Chains of up to 10 000 bodies, pulled, spun, closed to a loop, driven and laid on the floor.
#include <gtest/gtest.h>

#include "scene.h"
#include "stress_run.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

StressScene long_chain(int links) {
  StressScene scene;
  scene.definition.model = chain({.links = links, .bend = 0.05, .yield_torque = 0.5, .flow_damping = 0.1}).definition;
  scene.spins.assign(links, Eigen::Vector3d::Zero());
  scene.forces.resize(links);
  scene.h = 1.0 / 30;
  scene.steps = links > 1000 ? 2 : 10;
  return scene;
}

void expect_sound(const StressScene& scene) {
  const StressOutcome outcome = run(scene);
  EXPECT_EQ(outcome.failure, "");
  EXPECT_EQ(outcome.unconverged, 0);
}

TEST(LongChain, Hanging_KeepsEveryPromise) {
  for (const int links : {1000, 10000}) expect_sound(long_chain(links));
}

TEST(LongChain, PulledBeyondAllMeasure_KeepsEveryPromise) {
  for (const int links : {1000, 10000}) {
    StressScene scene = long_chain(links);
    scene.forces.back().force = {0.0, 6e5, 8e5};
    expect_sound(scene);
  }
}

TEST(LongChain, Spinning_KeepsEveryPromise) {
  for (const int links : {1000, 10000}) {
    StressScene scene = long_chain(links);
    scene.spins.back() = {600.0, 0.0, 800.0};
    scene.spins[links / 2] = {0.0, 1000.0, 0.0};
    expect_sound(scene);
  }
}

TEST(LongChain, HeldByAHandThatJumps_KeepsEveryPromise) {
  for (const int links : {1000, 10000}) {
    StressScene scene = long_chain(links);
    scene.couplings.push_back({.body = links - 1, .stiffness = 1e6, .damping = 100.0});
    scene.teleport = {3.0, -5.0, 8.0};
    expect_sound(scene);
  }
}

TEST(LongChain, TiedToItself_KeepsEveryPromise) {
  for (const int links : {1000, 10000}) {
    StressScene scene = long_chain(links);
    scene.ties.push_back({.body_a = links - 1, .body_b = links / 2});
    scene.ties.push_back({.body_a = links - 2, .stiffness = 1e4, .damping = 10.0, .max_force = 50.0});
    scene.ties.back().holds_rotation = true;
    expect_sound(scene);
  }
}

TEST(LongChain, DrivenStraight_KeepsEveryPromise) {
  for (const int links : {1000, 10000}) {
    StressScene scene = long_chain(links);
    for (int i = 0; i < links; i += 3) {
      scene.drives.push_back({.body = i, .stiffness = 100.0, .damping = 1.0, .max_torque = i % 2 == 0 ? 0.2 : 1e9});
    }
    expect_sound(scene);
  }
}

TEST(LongChain, OnTheFloor_KeepsEveryPromise) {
  for (const int links : {1000, 10000}) {
    StressScene scene = long_chain(links);
    collision::ShapeDefinition& floor = scene.definition.shapes.emplace_back();
    floor.name = "floor";
    floor.shape = collision::Plane{};
    floor.X_BS.position.z() = -0.5;
    for (int i = links / 10; i < links; i += links / 10) {
      collision::ShapeDefinition& ball = scene.definition.shapes.emplace_back();
      ball.name = "ball " + std::to_string(i);
      ball.shape = collision::Sphere{.radius = 0.02};
      ball.body = i;
    }
    expect_sound(scene);
  }
}

}  // namespace
}  // namespace layfigure::testing
