// The energy ledger: what goes in, what is lost, what stays.
#include <gtest/gtest.h>

#include <cmath>

#include "scene.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

struct Ledger {
  Work work;
  double gained;   ///< E at the end less E at the start
  double created;  ///< largest sum of gained + lost - input on the way
};

Ledger keep_ledger(const Scene& scene, int steps, int order) {
  const Model model(scene.definition);
  State state = initial_state(model);
  Workspace workspace(model);
  const Pulls pulls(scene.pulls);
  const double start = energy(model, state).total();
  Ledger ledger{.work = {}, .gained = 0.0, .created = 0.0};
  for (int k = 0; k < steps; ++k) {
    state.time = scene.duration * k / steps;
    const StepReport report =
        step(model, state, workspace, {.loads = &pulls}, {.step = scene.duration / steps, .order = order});
    EXPECT_EQ(report.status, StepStatus::kOk);
    ledger.work.input += report.work.input;
    ledger.work.viscous += report.work.viscous;
    ledger.work.flow += report.work.flow;
    ledger.gained = energy(model, state).total() - start;
    ledger.created =
        std::max(ledger.created, ledger.gained + ledger.work.viscous + ledger.work.flow - ledger.work.input);
  }
  return ledger;
}

Scene yielding_scene() {
  Scene scene = pulled_chain({.links = 12, .bend = 0.2, .damping = 0.05, .yield_torque = 0.05, .flow_damping = 0.02});
  scene.definition.gravity = {0.0, 0.0, -9.81};
  return scene;
}

TEST(Ledger, PulledPastYield_ClosesAsTheStepShrinks) {
  const Scene scene = yielding_scene();
  const auto gap = [&](int steps) {
    const Ledger ledger = keep_ledger(scene, steps, 1);
    EXPECT_GT(ledger.work.flow, 0.01) << "the scene must flow";
    EXPECT_GT(std::abs(ledger.work.input), 0.01);
    return ledger.work.input - ledger.work.viscous - ledger.work.flow - ledger.gained;
  };
  const double coarse = gap(500);
  const double fine = gap(2000);
  EXPECT_GT(coarse, 0.0) << "what is missing is damping, never energy from nowhere";
  EXPECT_GT(fine, 0.0);
  EXPECT_NEAR(coarse / fine, 4.0, 1.0) << coarse << " J -> " << fine << " J";
}

TEST(Ledger, BaseSteps_CreateNoEnergy) {
  for (const int steps : {30, 60, 250, 1000, 4000}) {
    const Ledger ledger = keep_ledger(yielding_scene(), steps, 1);
    EXPECT_LE(ledger.created, 1e-12) << steps << " steps";
  }
}

TEST(Ledger, Coupling_AccountsForItsWork) {
  // A weight drawn up by a hand: the input is the gain in height and the loss in the coupling's own damper is not the
  // doll's.
  ModelDefinition definition;
  definition.root = RootKind::kFree;
  definition.bodies.resize(1);
  definition.bodies[0].mass = 2.0;
  const Model model(definition);
  State state = initial_state(model);
  Workspace workspace(model);
  double input = 0.0;
  Coupling hand{.body = 0, .stiffness = 5000.0, .damping = 300.0};
  hand.target_velocity = {0.0, 0.0, 0.1};
  for (int k = 0; k < 5000; ++k) {
    hand.target_position = k * 1e-3 * hand.target_velocity;
    const StepReport report = step(model, state, workspace, {.couplings = {&hand, 1}}, {.step = 1e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    input += report.work.input;
  }
  EXPECT_NEAR(input, energy(model, state).total(), 1e-3 * input);
}

}  // namespace
}  // namespace layfigure::testing
