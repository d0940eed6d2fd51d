#include <gtest/gtest.h>

#include <algorithm>

#include "allocation_count.h"
#include "constrained_scene.h"
#include "layfigure/dynamics/advance.h"
#include "layfigure/dynamics/step.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

TEST(Step, AfterTheFirst_AllocatesNothing) {
  const testing::Scene scene =
      testing::pulled_chain({.links = 20, .bend = 0.3, .yield_torque = 0.05, .flow_damping = 0.02});
  const Model model(scene.definition);
  const testing::Pulls pulls(scene.pulls);
  const Coupling coupling{.body = 4, .stiffness = 100.0, .damping = 1.0};
  for (int order = 1; order <= kMaxOrder; ++order) {
    State state = initial_state(model);
    Workspace workspace(model);
    const Inputs inputs{.loads = &pulls, .couplings = {&coupling, 1}};
    ASSERT_EQ(step(model, state, workspace, inputs, {.step = 2e-3, .order = order}).status, StepStatus::kOk);
    const long before = testing::allocation_count();
    int yielding = 0;
    for (int k = 0; k < 100; ++k) {
      yielding += step(model, state, workspace, inputs, {.step = 2e-3, .order = order}).yielding;
    }
    EXPECT_EQ(testing::allocation_count() - before, 0) << "order " << order;
    EXPECT_GT(yielding, 0) << "the scene must reach the flow law's code";
    StepSize size;
    EXPECT_EQ(advance(model, state, workspace, inputs, 0.1, {}, size).status, StepStatus::kOk);
    EXPECT_EQ(testing::allocation_count() - before, 0);
  }
}

TEST(Step, OnTwoThreads_AllocatesNothing) {
  const testing::Scene scene = testing::load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json");
  const Model model(scene.definition);
  Workspace workspace(model, 2);
  State state = initial_state(model);
  const StepOptions options{.step = 1e-3, .order = 4};
  ASSERT_EQ(step(model, state, workspace, {}, options).status, StepStatus::kOk);
  const long before = testing::allocation_count();
  for (int k = 0; k < 100; ++k) ASSERT_EQ(step(model, state, workspace, {}, options).status, StepStatus::kOk);
  EXPECT_EQ(testing::allocation_count() - before, 0);
}

TEST(Step, FallingAsleepAndWaking_AllocatesNothing) {
  ModelDefinition definition = testing::chain({.links = 20, .bend = 0.1, .damping = 0.2}).definition;
  definition.gravity.setZero();
  for (BodyDefinition& body : definition.bodies) body.rest_rotation = body.rotation;
  const Model model(definition);
  const testing::Pulls pulls({{.body = 10, .force = {0.0, 0.0, 0.01}, .start = 1.0, .end = 1.5}});
  for (const int order : {1, 4}) {
    State state = initial_state(model);
    Workspace workspace(model);
    const long before = testing::allocation_count();
    int most = 0, least = model.size();
    for (int k = 0; k < 1000; ++k) {
      const StepReport report =
          step(model, state, workspace, {.loads = &pulls}, {.step = 2e-3, .order = order, .sleep_angle = kSleepAngle});
      if (report.resting) continue;
      most = std::max(most, report.asleep);
      if (most > 0) least = std::min(least, report.asleep);
    }
    EXPECT_EQ(testing::allocation_count() - before, 0) << "order " << order;
    EXPECT_GE(most, 5) << "links behind the pulled one";
    EXPECT_LT(least, most);
  }
}

TEST(Step, WithConstraintsThatItHasSeen_AllocatesNothing) {
  const Model model(testing::bent_tree(RootKind::kFree, 0.3));
  const State start = initial_state(model);
  const std::vector<Contact> contacts = testing::tree_contacts(model, start);
  const std::vector<Tie> ties = testing::tree_ties(model, start);
  Drive drive{.body = 6, .stiffness = 20.0, .damping = 0.1, .max_torque = 0.1};
  drive.target_velocity = {1.0, 0.0, 2.0};
  const Inputs inputs{.contacts = contacts, .ties = ties, .drives = {&drive, 1}};
  for (const int order : {1, 4}) {
    Workspace workspace(model);
    State state = start;
    const auto run = [&] {
      int rows = 0;
      for (int k = 0; k < 50; ++k) {
        rows = std::max(rows, step(model, state, workspace, inputs, {.step = 1e-3, .order = order}).constraints.rows);
      }
      return rows;
    };
    EXPECT_GT(run(), 15);
    for (std::size_t i = 0; i < start.bodies.size(); ++i) state.bodies[i] = start.bodies[i];
    const long before = testing::allocation_count();
    EXPECT_GT(run(), 15);
    EXPECT_EQ(testing::allocation_count() - before, 0) << "order " << order;
  }
}

}  // namespace
}  // namespace layfigure::dynamics
