#include <gtest/gtest.h>

#include "allocation_count.h"
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
  for (const int order : {1, 2, 3, 4}) {
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

}  // namespace
}  // namespace layfigure::dynamics
