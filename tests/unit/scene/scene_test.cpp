#include "layfigure/scene/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <set>

#include "touching_scenes.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;
using scene::Scene;
using scene::SceneDefinition;
using scene::SceneReport;

constexpr double kG = 9.81;

TEST(Scene, NothingThatMayMeet_LooksForNothing) {
  SceneDefinition definition = stack(3, 0.5, 0.5);
  for (auto& shape : definition.shapes) shape.group = 1;
  Scene scene(definition);
  State state = initial_state(scene.model());
  const SceneReport report = scene.step(state, {}, {.step = 1e-3});
  EXPECT_EQ(report.collision.box_tests, 0);
  EXPECT_EQ(report.collision.narrow_tests, 0);
  EXPECT_EQ(report.step.constraints.rows, 0);
}

TEST(Scene, ThingsFarFromEachOther_MakeNoRows) {
  Scene scene(stack(3, 0.5, 0.5));
  State state = initial_state(scene.model());
  const SceneReport report = scene.step(state, {}, {.step = 1e-3});
  EXPECT_EQ(report.collision.narrow_tests, 0);
  EXPECT_EQ(report.step.constraints.rows, 0);
}

TEST(Scene, Stack_StandsStillAtAnyStep) {
  for (const double h : {1.0 / 30, 1.0 / 240, 1e-3}) {
    Scene scene(stack(5, 0.0, 0.5));
    State state = initial_state(scene.model());
    for (int n = 0; n * h < 3.0; ++n) {
      const SceneReport report = scene.step(state, {}, {.step = h});
      ASSERT_EQ(report.step.status, StepStatus::kOk);
      ASSERT_EQ(report.step.constraints.unsolved, 0)
          << "step " << n << " residual " << report.step.constraints.residual;
    }
    for (int k = 0; k < 5; ++k) {
      EXPECT_NEAR(state.bodies[k].position.z(), 0.05 + 0.1 * k, 1e-6) << "h = " << h;
      EXPECT_LE(state.bodies[k].position.head<2>().norm(), 1e-6);
    }
    double carried = 0.0;
    for (std::size_t k = 0; k < scene.contacts().size(); ++k) {
      if (scene.contacts()[k].body_b == collision::kWorldBody) carried += scene.contact_force(static_cast<int>(k)).z();
    }
    EXPECT_NEAR(carried, 5.0 * kG, 1e-6);
  }
}

TEST(Scene, FallenStack_ComesToRestWithoutOverlap) {
  for (const double h : {1.0 / 60, 1e-3}) {
    Scene scene(stack(4, 0.2, 0.5));
    State state = initial_state(scene.model());
    double deepest = 0.0;
    for (int n = 0; n * h < 2.0; ++n) {
      const SceneReport report = scene.step(state, {}, {.step = h});
      ASSERT_EQ(report.step.status, StepStatus::kOk);
      for (const auto& point : scene.contacts()) deepest = std::max(deepest, -point.gap);
    }
    EXPECT_LE(deepest, 1e-3) << "h = " << h;
    EXPECT_LE(energy(scene.model(), state).kinetic, 1e-8);
  }
}

TEST(Scene, ContactsOfNeighbouringShapes_AreRememberedApart) {
  constexpr int kCubes = 4;
  SceneDefinition definition = stack(kCubes, 0.0, 0.5);
  for (int k = 0; k < kCubes; ++k) definition.model.bodies[k].anchor = {0.3 * k, 0.0, 0.05};
  Scene scene(definition);
  State state = initial_state(scene.model());
  for (int n = 0; n < 3; ++n) {
    ASSERT_EQ(scene.step(state, {}, {.step = 1e-3}).step.status, StepStatus::kOk);
    std::set<std::uint64_t> keys;
    for (const ConstraintMemory& memory : state.constraints) keys.insert(memory.key);
    EXPECT_EQ(keys.size(), 4 * kCubes) << "step " << n;
  }
}

TEST(Scene, DroppedDoll_LiesOnTheFloor) {
  for (const double h : {1.0 / 60, 1.0 / 240, 1e-3}) {
    Scene scene(capsule_doll(1.3, 8.0));
    State state = initial_state(scene.model());
    double deepest = 0.0;
    int unsolved = 0;
    for (int n = 0; n * h < 4.0; ++n) {
      const SceneReport report = scene.step(state, {}, {.step = h});
      ASSERT_EQ(report.step.status, StepStatus::kOk);
      unsolved += report.step.constraints.unsolved;
      for (const auto& point : scene.contacts()) deepest = std::max(deepest, -point.gap);
    }
    EXPECT_EQ(unsolved, 0) << "h = " << h;
    EXPECT_LE(deepest, 5e-3) << "h = " << h;
    EXPECT_LE(energy(scene.model(), state).kinetic, 1e-3) << "h = " << h;
    double weight = 0.0;
    for (int i = 0; i < scene.model().size(); ++i) weight += scene.model().body(i).mass * kG;
    double carried = 0.0;
    for (std::size_t k = 0; k < scene.contacts().size(); ++k) {
      if (scene.contacts()[k].body_b == collision::kWorldBody) carried += scene.contact_force(static_cast<int>(k)).z();
    }
    EXPECT_NEAR(carried / weight, 1.0, 0.05) << "h = " << h;
  }
}

TEST(Scene, StackAtRest_RestsAsAWholeUntilSomethingActs) {
  Scene scene(stack(4, 0.0, 0.5));
  State state = initial_state(scene.model());
  const StepOptions options{.step = 1e-3, .sleep_angle = kSleepAngle};
  SceneReport report;
  for (int n = 0; n < 1000; ++n) report = scene.step(state, {}, options);
  ASSERT_TRUE(report.step.resting);
  EXPECT_EQ(report.step.solves, 0);
  const State resting = state;
  for (int n = 0; n < 1000; ++n) report = scene.step(state, {}, options);
  EXPECT_TRUE(report.step.resting);
  EXPECT_EQ(state.bodies[3].position, resting.bodies[3].position);
  Coupling coupling{.body = 3, .stiffness = 1000.0, .damping = 10.0};
  coupling.target_position = state.bodies[3].position + Eigen::Vector3d(0.1, 0.0, 0.0);
  report = scene.step(state, {.couplings = {&coupling, 1}}, options);
  EXPECT_FALSE(report.step.resting);
  for (int n = 0; n < 300; ++n) report = scene.step(state, {.couplings = {&coupling, 1}}, options);
  EXPECT_GT(state.bodies[3].position.x(), 0.01);
}

TEST(Scene, FastBody_DoesNotPassThroughTheFloor) {
  for (const double h : {0.1, 1.0 / 30, 1e-3}) {
    Scene scene(stack(1, 3.0, 0.5));
    State state = initial_state(scene.model());
    state.bodies[0].linear_momentum = {0.0, 0.0, -200.0};
    for (int n = 0; n * h < 1.0; ++n) (void)scene.step(state, {}, {.step = h});
    EXPECT_NEAR(state.bodies[0].position.z(), 0.05, 1e-3) << "h = " << h;
  }
}

TEST(Scene, SavedState_ReplaysBitForBit) {
  Scene scene(capsule_doll(1.0, 8.0));
  State state = initial_state(scene.model());
  for (int n = 0; n < 400; ++n) (void)scene.step(state, {}, {.step = 2e-3});
  const State saved = state;
  const auto go_on = [&] {
    scene.forget();
    State copy = saved;
    for (int n = 0; n < 100; ++n) (void)scene.step(copy, {}, {.step = 2e-3});
    return copy;
  };
  const State first = go_on();
  const State second = go_on();
  for (std::size_t i = 0; i < first.bodies.size(); ++i) {
    EXPECT_EQ(first.bodies[i].rotation.coeffs(), second.bodies[i].rotation.coeffs());
    EXPECT_EQ(first.bodies[i].linear_momentum, second.bodies[i].linear_momentum);
  }
}

TEST(Scene, BadShape_IsRefusedByName) {
  SceneDefinition definition = stack(1, 0.0, 0.5);
  definition.shapes[1].body = 7;
  try {
    Scene scene(definition);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("cube 0"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace layfigure::testing
