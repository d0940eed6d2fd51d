#include "layfigure/dynamics/advance.h"

#include <gtest/gtest.h>

#include <limits>

#include "scene.h"

namespace layfigure::dynamics {
namespace {

using testing::Scene;

struct Outcome {
  AdvanceReport report;
  std::vector<Eigen::Vector3d> coms;
};

Outcome advance_scene(const Scene& scene, double tolerance) {
  const Model model(scene.definition);
  State state = initial_state(model);
  Workspace workspace(model);
  const testing::Pulls pulls(scene.pulls);
  StepSize size;
  Outcome outcome;
  outcome.report = advance(model, state, workspace, {.loads = &pulls}, scene.duration, {.tolerance = tolerance}, size);
  EXPECT_DOUBLE_EQ(state.time, scene.duration);
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  for (const BodyPose& pose : poses) outcome.coms.push_back(pose.com);
  return outcome;
}

TEST(Advance, TighterTolerance_GivesASmallerError) {
  const Scene doll = testing::load_scene(std::string(LAYFIGURE_TEST_DATA) + "/scenes/doll-52.json");
  const auto reference = testing::run_scene(doll, Model(doll.definition), 4000, 4).coms;
  double last = 1.0;
  for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-8}) {
    const Outcome outcome = advance_scene(doll, tolerance);
    EXPECT_EQ(outcome.report.status, StepStatus::kOk);
    EXPECT_LE(outcome.report.largest_error, tolerance);
    const double error = testing::rms_distance(outcome.coms, reference);
    EXPECT_LT(error, 0.1 * last) << tolerance;
    last = error;
  }
}

TEST(Advance, KinksOfTheFlowLaw_AreFound) {
  for (const FlowLaw law : {FlowLaw::kPaper, FlowLaw::kOverstress}) {
    const Scene scene =
        testing::pulled_chain({.links = 20, .damping = 0.05, .yield_torque = 0.1, .flow_damping = 0.2, .law = law});
    const auto reference = testing::run_scene(scene, Model(scene.definition), 16000, 3).coms;
    const Outcome coarse = advance_scene(scene, 1e-4);
    const Outcome fine = advance_scene(scene, 1e-7);
    EXPECT_GT(fine.report.rejected, 0) << "the steps must have met a kink";
    EXPECT_LT(testing::rms_distance(coarse.coms, reference), 2e-4);
    EXPECT_LT(testing::rms_distance(fine.coms, reference), 2e-6);
  }
}

TEST(Advance, MovingTarget_MovesOnThroughTheStepsOfOneAdvance) {
  const Scene scene = testing::chain({.links = 5});
  const Model model(scene.definition);
  Coupling hand{.body = 4, .point = {0.1, 0.0, 0.0}, .stiffness = 200.0, .damping = 5.0};
  hand.target_position = {0.5, 0.0, 0.0};
  hand.target_velocity = {0.0, 0.4, 0.2};
  State at_once = initial_state(model);
  Workspace workspace(model);
  StepSize size;
  const auto report = advance(model, at_once, workspace, {.couplings = {&hand, 1}}, 0.2, {.tolerance = 1e-8}, size);
  EXPECT_GT(report.steps, 3);

  State by_hand = initial_state(model);
  constexpr int kSteps = 2000;
  for (int k = 0; k < kSteps; ++k) {
    Coupling now = hand;
    now.target_position += 0.2 * k / kSteps * hand.target_velocity;
    ASSERT_EQ(step(model, by_hand, workspace, {.couplings = {&now, 1}}, {.step = 0.2 / kSteps, .order = 4}).status,
              StepStatus::kOk);
  }
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT((at_once.bodies[i].rotation.coeffs() - by_hand.bodies[i].rotation.coeffs()).norm(), 1e-6) << i;
  }
}

TEST(Advance, NotFiniteLoad_StopsAtTheLastGoodState) {
  class Broken : public Loads {
    void add(double time, std::span<BodyForce> forces) const override {
      if (time > 0.1) forces[0].force.x() = std::numeric_limits<double>::quiet_NaN();
    }
  };
  const Model model(testing::chain({.links = 3}).definition);
  State state = initial_state(model);
  Workspace workspace(model);
  StepSize size;
  const Broken broken;
  const auto report =
      advance(model, state, workspace, {.loads = &broken}, 0.2, {.tolerance = 1e-4, .smallest_step = 1e-5}, size);
  EXPECT_EQ(report.status, StepStatus::kNotFinite);
  EXPECT_NEAR(state.time, 0.1, 1e-4);
  EXPECT_TRUE(state.bodies[2].rotation.coeffs().allFinite());
}

TEST(Advance, NoDuration_DoesNothing) {
  const Model model(testing::chain({.links = 3}).definition);
  State state = initial_state(model);
  Workspace workspace(model);
  StepSize size;
  const auto report = advance(model, state, workspace, {}, 0.0, {}, size);
  EXPECT_EQ(report.steps, 0);
  EXPECT_EQ(state.time, 0.0);
}

}  // namespace
}  // namespace layfigure::dynamics
