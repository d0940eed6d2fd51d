#include <gtest/gtest.h>

#include "allocation_count.h"
#include "haptic_rig.h"
#include "layfigure/haptics/passivity.h"

namespace layfigure::haptics {
namespace {

using testing::allocation_count;

TEST(Allocations, TickHandOverAndPassivity_AreNone) {
  const testing::HeldScene held = testing::touched_limb({{.stiffness = 800.0, .damping = 4.0}});
  CouplingTarget target = testing::held_pose(held, 0);
  target.position.z() -= 0.006;
  const std::vector<testing::Hand> hand{[&](double) { return target; }};
  testing::MultirateRig rig(held, 500.0, 1000.0);
  for (int k = 0; k < 400; ++k) (void)rig.tick(hand);
  ASSERT_GT(rig.model().contacts, 0) << "it touches";
  LocalDynamics local;
  PortWrench felt;
  Passivity passivity;
  passivity.configure({.judge = PassivityOptions::Judge::kTogether});
  local.hand_over(rig.model());
  const long before = allocation_count();
  for (int k = 0; k < 100; ++k) {
    if (k % 10 == 0) local.hand_over(rig.model());
    local.tick({&target, 1}, {&felt, 1});
    PassivityPort port{
        .force = felt.force, .torque = felt.torque, .displacement = {1e-5, 0.0, 0.0}, .turn = Eigen::Vector3d::Zero()};
    passivity.tick(1e-3, {&port, 1});
    if (k % 10 == 9) (void)local.end_interval();
  }
  EXPECT_EQ(allocation_count() - before, 0);
}

TEST(Allocations, MakingModels_AreNoneOnceThereHaveBeenAsMany) {
  const testing::HeldScene held = testing::held_doll(2, {.stiffness = 1000.0, .damping = 5.0});
  scene::Scene scene(held.definition);
  LocalModeler modeler(scene.model());
  LocalModel model;
  dynamics::State state = held.start;
  dynamics::State before = state;
  long allocations = 0;
  for (int k = 0; k < 20; ++k) {
    before = state;
    (void)scene.step(state, {}, {.step = 2e-3});
    const long start = allocation_count();
    const TrialStep trial{
        .before = before, .workspace = scene.workspace(), .loads = {}, .contacts = {}, .length = 2e-3};
    ASSERT_TRUE(modeler.make(trial, held.pointers, 1e-4, model));
    if (k > 2) allocations += allocation_count() - start;
  }
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace layfigure::haptics
