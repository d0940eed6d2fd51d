#include "layfigure/dynamics/step.h"

#include <gtest/gtest.h>

#include <limits>

#include "same_bits.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

using testing::chain;
using testing::first_difference;
using testing::load_scene;
using testing::run_scene;
using testing::Scene;

const std::string kScenes = std::string(LAYFIGURE_TEST_DATA) + "/scenes/";

TEST(Step, SameInputs_GiveTheSameBits) {
  const Scene scene = testing::pulled_chain({.links = 12, .bend = 0.3, .yield_torque = 0.05, .flow_damping = 0.02});
  const Model model(scene.definition);
  for (const int order : {1, 2, 3, 4}) {
    const auto first = run_scene(scene, model, 100, order);
    const auto second = run_scene(scene, model, 100, order);
    EXPECT_EQ(first_difference(first.state, second.state), "") << "order " << order;
  }
}

TEST(Step, SavedAndRestoredState_GoesOnWithTheSameBits) {
  const Scene scene = testing::pulled_chain({.links = 12, .bend = 0.3, .yield_torque = 0.05, .flow_damping = 0.02});
  const Model model(scene.definition);
  const testing::Pulls pulls(scene.pulls);
  State state = initial_state(model);
  Workspace workspace(model);
  const auto advance = [&](State& s, Workspace& w, int steps) {
    for (int k = 0; k < steps; ++k) {
      ASSERT_EQ(step(model, s, w, {.loads = &pulls}, {.step = 4e-3, .order = 3}).status, StepStatus::kOk);
    }
  };
  advance(state, workspace, 50);
  State restored = state;
  Workspace fresh(model);
  advance(state, workspace, 50);
  advance(restored, fresh, 50);
  EXPECT_EQ(first_difference(state, restored), "");
}

TEST(Step, NotFiniteLoad_LeavesTheStateAndSaysSo) {
  class Broken : public Loads {
    void add(double, std::span<BodyForce> forces) const override {
      forces[3].force.x() = std::numeric_limits<double>::quiet_NaN();
    }
  };
  for (const char* name : {"doll-52.json", "chain-20.json"}) {
    const Scene scene = load_scene(kScenes + name);
    const Model model(scene.definition);
    for (const int order : {1, 2, 4}) {
      State state = initial_state(model);
      const State before = state;
      Workspace workspace(model);
      const Broken broken;
      EXPECT_EQ(step(model, state, workspace, {.loads = &broken}, {.step = 1e-3, .order = order}).status,
                StepStatus::kNotFinite);
      EXPECT_EQ(first_difference(state, before), "");
      EXPECT_EQ(step(model, state, workspace, {}, {.step = 1e-3, .order = order}).status, StepStatus::kOk)
          << "the workspace must recover";
    }
  }
}

TEST(Step, FreeDoll_KeepsItsMomenta) {
  Scene scene = load_scene(kScenes + "doll-52.json");
  scene.definition.root = RootKind::kFree;
  scene.definition.gravity.setZero();
  const Model model(scene.definition);
  State state = initial_state(model);
  state.bodies[20].angular_momentum = {0.001, -0.002, 0.003};
  state.bodies[9].linear_momentum = {1.0, -0.5, 0.2};
  Workspace workspace(model);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (const BodyState& body : state.bodies) before += body.linear_momentum;
  for (int k = 0; k < 500; ++k) {
    ASSERT_EQ(step(model, state, workspace, {}, {.step = 2e-3}).status, StepStatus::kOk);
  }
  Eigen::Vector3d after = Eigen::Vector3d::Zero();
  for (const BodyState& body : state.bodies) after += body.linear_momentum;
  EXPECT_LT((after - before).norm(), 1e-12 * before.norm());
}

TEST(Step, FixedRoot_StaysAndItsLimbsMoveAsOnAWall) {
  Scene fixed = chain({.links = 6});
  fixed.definition.root = RootKind::kFixed;
  const Model model(fixed.definition);
  State state = initial_state(model);
  Workspace workspace(model);
  for (int k = 0; k < 200; ++k) ASSERT_EQ(step(model, state, workspace, {}, {}).status, StepStatus::kOk);
  EXPECT_EQ(state.bodies[0].rotation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_EQ(state.bodies[0].linear_momentum, Eigen::Vector3d::Zero());

  // The same with links 1 to 5 alone, hung from the world where link 0 ends.
  Scene hung = chain({.links = 6});
  hung.definition.bodies.erase(hung.definition.bodies.begin());
  for (auto& body : hung.definition.bodies) --body.parent;
  const Model other(hung.definition);
  State reference = initial_state(other);
  Workspace scratch(other);
  for (int k = 0; k < 200; ++k) ASSERT_EQ(step(other, reference, scratch, {}, {}).status, StepStatus::kOk);
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT((state.bodies[i + 1].rotation.coeffs() - reference.bodies[i].rotation.coeffs()).norm(), 1e-12);
  }
}

TEST(Step, WithoutLoads_EnergyNeverGrows) {
  for (const double h : {1e-4, 1e-3, 1e-2, 1.0 / 30}) {
    const Scene scene = chain({.links = 30, .bend = 0.3, .damping = 0.0});
    const Model model(scene.definition);
    State state = initial_state(model);
    Workspace workspace(model);
    const double start = energy(model, state).total();
    double highest = start;
    for (int k = 0; k * h < 1.0; ++k) {
      ASSERT_EQ(step(model, state, workspace, {}, {.step = h}).status, StepStatus::kOk);
      highest = std::max(highest, energy(model, state).total());
    }
    // The scene holds some 10 J; gravity and strain at the old configuration may differ from the new one's by O(h^2).
    EXPECT_LT(highest - start, 20.0 * h * h) << h;
  }
}

TEST(Step, Quaternions_StayUnit) {
  const Scene scene = chain({.links = 40, .bend = 0.3});
  const Model model(scene.definition);
  for (const int order : {1, 4}) {
    const auto run = run_scene(scene, model, 1000, order);
    for (const BodyState& body : run.state.bodies) {
      EXPECT_NEAR(body.rotation.norm(), 1.0, 1e-14);
      EXPECT_NEAR(body.rest_rotation.norm(), 1.0, 1e-14);
    }
  }
}

TEST(Step, SeveralRoots_MoveAsTheyWouldAlone) {
  Scene alone = chain({.links = 5, .bend = 0.2});
  Scene both = alone;
  for (const auto& body : alone.definition.bodies) {
    both.definition.bodies.push_back(body);
    if (body.parent >= 0) both.definition.bodies.back().parent += 5;
  }
  const auto one = run_scene(alone, Model(alone.definition), 200, 2);
  const auto two = run_scene(both, Model(both.definition), 200, 2);
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT((one.coms[i] - two.coms[i]).norm(), 1e-12);
    EXPECT_LT((one.coms[i] - two.coms[i + 5]).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace layfigure::dynamics
