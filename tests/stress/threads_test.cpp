// What comes of a step does not depend on how its runs are shared between threads.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "layfigure/dynamics/advance.h"
#include "random_scene.h"
#include "same_bits.h"
#include "scene.h"
#include "workspace.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr int kThreads = 3;
// What joints lose is summed in the order of the slots, which depends on the shares; all parts have the same sign.
constexpr double kWorkRounding = 1e-13;

/// Shares the runs of an order anyhow, whether that is worth while or not.
void share_anyhow(std::mt19937& random, int order, Workspace& workspace) {
  Shares shares{.count = 0};
  for (int end = 1; end < order && shares.count + 1 < kThreads; ++end) {
    if (random() % 2 == 0) shares.ends[++shares.count] = end;
  }
  shares.ends[++shares.count] = order;
  workspace.data().shares[order - 1] = shares;
}

void expect_same_reports(const StepReport& a, const StepReport& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.solves, b.solves);
  EXPECT_EQ(a.run_solves, b.run_solves);
  EXPECT_EQ(a.yielding, b.yielding);
  EXPECT_EQ(a.converged, b.converged);
  EXPECT_EQ(a.asleep, b.asleep);
  EXPECT_EQ(a.extrapolated, b.extrapolated);
  EXPECT_EQ(a.constraints.rows, b.constraints.rows);
  EXPECT_EQ(a.constraints.unsolved, b.constraints.unsolved);
  EXPECT_NEAR(a.work.viscous, b.work.viscous, kWorkRounding * std::abs(a.work.viscous));
  EXPECT_NEAR(a.work.flow, b.work.flow, kWorkRounding * std::abs(a.work.flow));
}

/// Steps in which there was something to compare.
struct Seen {
  int yielding{0};
  int constrained{0};
  int asleep{0};
  int apart{0};  ///< Newton's method took longer in some runs or sub-steps than in others
};

/// Steps a random scene at an order, its runs in one share and in any.
void compare(StressScene scene, int order, std::mt19937& random, Seen& seen) {
  scene::Scene alone(scene.definition);
  scene::Scene shared(scene.definition, kThreads);
  State state = initial_state(alone.model());
  State other = state;
  const ConstantForces loads(scene.forces);
  const StepOptions options{.step = scene.h, .order = order, .sleep_angle = scene.sleep_angle};
  for (int k = 0; k < scene.steps; ++k) {
    if (k == scene.steps / 2) {
      for (Coupling& coupling : scene.couplings) coupling.target_position += scene.teleport;
    }
    const Inputs inputs{.loads = &loads, .couplings = scene.couplings, .ties = scene.ties, .drives = scene.drives};
    share_anyhow(random, order, shared.workspace());
    const StepReport first = alone.step(state, inputs, options).step;
    const StepReport second = shared.step(other, inputs, options).step;
    expect_same_reports(first, second);
    ASSERT_EQ(first_difference(state, other), "") << "order " << order << ", step " << k;
    seen.yielding += first.yielding > 0 ? 1 : 0;
    seen.constrained += first.constraints.rows > 0 ? 1 : 0;
    seen.asleep += first.asleep > 0 ? 1 : 0;
    // If all runs took as long in all sub-steps, the former would be (order + 1) / 2 times the latter.
    seen.apart += 2 * first.run_solves != (order + 1) * first.solves ? 1 : 0;
    if (first.status != StepStatus::kOk) return;
  }
}

class Threads : public ::testing::TestWithParam<int> {};

TEST_P(Threads, RandomScenes_SharedAnyhow_AreTheSameBitForBit) {
  constexpr int kScenes = 200;
  const int order = GetParam();
  std::mt19937 random(order);
  Seen seen;
  for (int seed = 0; seed < kScenes && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    compare(random_scene(seed), order, random, seen);
  }
  EXPECT_GT(seen.yielding, 100);
  EXPECT_GT(seen.constrained, 100);
  EXPECT_GT(seen.asleep, 10);
  EXPECT_GT(seen.apart, 100);
}

INSTANTIATE_TEST_SUITE_P(Order, Threads, ::testing::Range(2, kMaxOrder + 1));

/// The doll of 52 joints, pulled until joints flow.
struct PulledDoll {
  PulledDoll() {
    for (BodyDefinition& body : scene.definition.bodies) body.joint.yield_torque = 0.5;
  }
  Scene scene{load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json")};
  Pulls pulls{{{.body = 9, .force = {0.0, 20.0, 10.0}, .start = 0.0, .end = 0.2}}};
};

TEST(TwoThreads, DollOfOrder3AndMore_IsSharedAndTheSameBitForBit) {
  const PulledDoll doll;
  const Model model(doll.scene.definition);
  Workspace alone(model);
  Workspace shared(model, 2);
  for (int order = 2; order <= kMaxOrder; ++order) {
    EXPECT_EQ(alone.data().shares[order - 1].count, 1);
    EXPECT_EQ(shared.data().shares[order - 1].count, order < 3 ? 1 : 2);
    State state = initial_state(model);
    State other = state;
    int yielding = 0;
    for (int k = 0; k < 200; ++k) {
      const StepOptions options{.step = 1e-3, .order = order};
      const StepReport report = step(model, state, alone, {.loads = &doll.pulls}, options);
      expect_same_reports(report, step(model, other, shared, {.loads = &doll.pulls}, options));
      yielding += report.yielding;
    }
    EXPECT_EQ(first_difference(state, other), "") << "order " << order;
    EXPECT_GT(yielding, 0);
  }
}

TEST(TwoThreads, ErrorControlledSteps_AreTheSameBitForBit) {
  const PulledDoll doll;
  const Model model(doll.scene.definition);
  Workspace alone(model);
  Workspace shared(model, 2);
  State state = initial_state(model);
  State other = state;
  StepSize size, other_size;
  for (int frame = 0; frame < 10; ++frame) {
    const Inputs inputs{.loads = &doll.pulls};
    const AdvanceReport report = advance(model, state, alone, inputs, 0.02, {}, size);
    const AdvanceReport second = advance(model, other, shared, inputs, 0.02, {}, other_size);
    EXPECT_EQ(report.status, StepStatus::kOk);
    EXPECT_EQ(report.steps, second.steps);
    EXPECT_EQ(report.run_solves, second.run_solves);
    EXPECT_EQ(size.order, other_size.order);
    ASSERT_EQ(first_difference(state, other), "") << "frame " << frame;
  }
}

TEST(TwoThreads, MovedWorkspace_GoesOn) {
  const PulledDoll doll;
  const Model model(doll.scene.definition);
  Workspace first(model, 2);
  State state = initial_state(model);
  const StepOptions options{.step = 1e-3, .order = 4};
  ASSERT_EQ(step(model, state, first, {}, options).status, StepStatus::kOk);
  Workspace second(std::move(first));
  EXPECT_EQ(step(model, state, second, {}, options).status, StepStatus::kOk);
}

TEST(Workspace, NumbersOfThreadsThatMakeNoSense_AreTakenForTheNearestThatDo) {
  const Model model(chain({.links = 3}).definition);
  EXPECT_EQ(Workspace(model, -1).data().scratch.size(), 1);
  EXPECT_EQ(Workspace(model, 0).data().scratch.size(), 1);
  EXPECT_EQ(Workspace(model, 1000).data().scratch.size(), kMaxOrder);
}

}  // namespace
}  // namespace layfigure::testing
