// advance() with a budget of solves: the best accuracy that fits the frame.
#include <gtest/gtest.h>

#include <algorithm>

#include "constrained_scene.h"
#include "layfigure/dynamics/advance.h"
#include "same_bits.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

constexpr double kFrame = 1.0 / 30;
constexpr int kFrames = 15;
// No budget of this file reaches it.
constexpr double kUnreachable = 1e-13;

struct Outcome {
  State state;
  std::vector<Eigen::Vector3d> coms;
  int most_run_solves{0};  ///< of a frame
  int short_frames{0};
  int steps{0};
};

Outcome run_frames(const Model& model, const State& start, const Inputs& inputs, const AdvanceOptions& options) {
  Outcome outcome{.state = start, .coms = {}};
  Workspace workspace(model);
  StepSize size;
  for (int frame = 0; frame < kFrames; ++frame) {
    const AdvanceReport report = advance(model, outcome.state, workspace, inputs, kFrame, options, size);
    EXPECT_EQ(report.status, StepStatus::kOk) << frame;
    outcome.most_run_solves = std::max(outcome.most_run_solves, report.run_solves);
    outcome.short_frames += report.fell_short ? 1 : 0;
    outcome.steps += report.steps;
  }
  EXPECT_NEAR(outcome.state.time, start.time + kFrames * kFrame, 1e-12);
  std::vector<BodyPose> poses;
  world_poses(model, outcome.state, poses);
  for (const BodyPose& pose : poses) outcome.coms.push_back(pose.com);
  return outcome;
}

Outcome run_doll(const AdvanceOptions& options) {
  const Model model(testing::load_scene(std::string(LAYFIGURE_TEST_DATA) + "/scenes/doll-52.json").definition);
  return run_frames(model, initial_state(model), {}, options);
}

TEST(Budget, ElasticDoll_IsNeverExceeded) {
  for (const int most : {1, 2, 3, 4, 7, 10, 15, 21, 22, 43, 100, 1000}) {
    const Outcome outcome = run_doll({.tolerance = kUnreachable, .most_solves = most});
    EXPECT_LE(outcome.most_run_solves, most);
    EXPECT_GT(2 * outcome.most_run_solves, most) << "most of the budget must be spent";
    EXPECT_EQ(outcome.short_frames, kFrames) << most;
  }
}

TEST(Budget, Doll_TheErrorFallsAsItGrows) {
  const std::vector<Eigen::Vector3d> exact = run_doll({.tolerance = 1e-11}).coms;
  double last = 1.0;
  for (const int most : {1, 4, 16, 64, 256, 1024}) {
    const Outcome outcome = run_doll({.tolerance = kUnreachable, .most_solves = most});
    const double error = testing::rms_distance(outcome.coms, exact);
    EXPECT_LT(error, 0.5 * last) << most;
    last = error;
  }
  EXPECT_LT(last, 1e-8);
}

TEST(Budget, OneThatIsNotNeeded_ChangesNoBit) {
  const Outcome free = run_doll({.tolerance = 1e-4});
  const Outcome rich = run_doll({.tolerance = 1e-4, .most_solves = 100000});
  EXPECT_EQ(rich.short_frames, 0);
  EXPECT_EQ(rich.steps, free.steps);
  EXPECT_EQ(testing::first_difference(free.state, rich.state), "");
}

TEST(Budget, MetTolerance_IsNotReportedAsMissed) {
  const Outcome outcome = run_doll({.tolerance = 1e-2, .most_solves = 60});
  EXPECT_LT(outcome.short_frames, kFrames);
  EXPECT_LE(outcome.most_run_solves, 60);
}

TEST(Budget, TwoRuns_HaveTheSameBits) {
  const AdvanceOptions options{.tolerance = 1e-6, .most_solves = 37};
  EXPECT_EQ(testing::first_difference(run_doll(options).state, run_doll(options).state), "");
}

// A block falls to the floor within the first frame, and lies there at the end.
TEST(Budget, ImpactInsideAFrame_EndsOnTheFloor) {
  const Eigen::Vector3d half_size(0.05, 0.04, 0.03);
  const Model model(testing::block(0.5, half_size, {0.0, 0.0, -9.81}));
  const std::vector<Contact> contacts = testing::corner_contacts(half_size, 0.5);
  State start = initial_state(model);
  start.bodies[0].position.z() = 0.01;
  start.bodies[0].linear_momentum.z() = -0.5;
  for (const int most : {1, 3, 10, 40, 200}) {
    const Outcome outcome = run_frames(model, start, {.contacts = contacts}, {.tolerance = 1e-6, .most_solves = most});
    const BodyState& block = outcome.state.bodies[0];
    EXPECT_NEAR(block.position.z(), 0.0, 1e-4) << most;
    EXPECT_LT(block.linear_momentum.norm(), 1e-3) << most;
  }
}

// Newton's method iterates: the excess over the budget is that of one step, and of a base step that ends the frame.
TEST(Budget, JointsThatFlow_ExceedItByAStepsIterationsAtMost) {
  const testing::Scene scene =
      testing::pulled_chain({.links = 20, .damping = 0.05, .yield_torque = 0.1, .flow_damping = 0.2});
  const Model model(scene.definition);
  const testing::Pulls pulls(scene.pulls);
  constexpr int kSubSteps = kMaxOrder * (kMaxOrder + 1) / 2;
  constexpr int kIterations = 7;  // Smooth flow takes 2 to 3, at a kink up to this.
  for (const int most : {1, 10, 100, 300}) {
    const Outcome outcome =
        run_frames(model, initial_state(model), {.loads = &pulls}, {.tolerance = kUnreachable, .most_solves = most});
    const int per_step = std::min(most, kSubSteps) * (kIterations - 1);
    EXPECT_LE(outcome.most_run_solves, most + per_step + kIterations) << most;
    EXPECT_GT(2 * outcome.most_run_solves, most) << most;
  }
}

}  // namespace
}  // namespace layfigure::dynamics
