// Contacts in the step: resting, sliding, friction's cone, impacts, trees that touch.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "constrained_scene.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kG = 9.81;
// What kLcpTolerance leaves of speeds of some metres per second.
constexpr double kComplementarity = 1e-9;
// The locked axis is 1e9 times stiffer than the joints are heavy: so many digits its row costs.
constexpr double kReplayTolerance = 2e-10;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Contact, BlockOnTheFloor_RestsAndTheForcesCarryIt) {
  for (const double h : {1.0 / 30, 1e-3}) {
    const Model model(block(2.0, {0.1, 0.2, 0.05}, {0.0, 0.0, -kG}));
    State state = initial_state(model);
    Workspace workspace(model);
    Eigen::Vector3d sum;
    for (int n = 0; n < 300; ++n) {
      const auto contacts = corner_contacts({0.1, 0.2, 0.05}, 0.5);
      const auto report = step(model, state, workspace, {.contacts = contacts}, {.step = h});
      ASSERT_EQ(report.status, StepStatus::kOk);
      ASSERT_EQ(report.constraints.unsolved, 0);
      sum.setZero();
      for (int k = 0; k < 4; ++k) sum += workspace.contact_force(k);
    }
    EXPECT_LE((sum - Eigen::Vector3d(0.0, 0.0, 2.0 * kG)).norm(), 1e-8);
    EXPECT_LE(state.bodies[0].position.norm(), 1e-9);
  }
}

TEST(Contact, BlockOnASlope_SticksBelowTheConesAngleAndSlidesAboveIt) {
  const double mu = 0.4;
  for (const double offset : {-1e-6, 1e-6}) {
    const double angle = std::atan(mu) + offset;
    const Eigen::Vector3d gravity(kG * std::sin(angle), 0.0, -kG * std::cos(angle));
    const Model model(block(1.0, {0.1, 0.1, 0.02}, gravity));
    State state = initial_state(model);
    Workspace workspace(model);
    const double h = 1e-3;
    for (int n = 0; n < 1000; ++n) {
      const auto contacts = corner_contacts({0.1, 0.1, 0.02}, mu);
      ASSERT_EQ(step(model, state, workspace, {.contacts = contacts}, {.step = h}).constraints.unsolved, 0);
    }
    const double expected = std::max(0.0, kG * (std::sin(angle) - mu * std::cos(angle)));
    EXPECT_NEAR(state.bodies[0].linear_momentum.x(), expected, 1e-9);
  }
}

TEST(Contact, FallingBlock_EndsItsFallOnTheFloor) {
  const Model model(block(1.0, {0.1, 0.1, 0.1}, {0.0, 0.0, -kG}));
  for (const double h : {1.0 / 30, 1.0 / 240, 1e-3}) {
    State state = initial_state(model);
    state.bodies[0].position.z() = 0.5;
    Workspace workspace(model);
    double lowest = 1.0;
    for (int n = 0; n * h < 1.0; ++n) {
      const auto contacts = corner_contacts({0.1, 0.1, 0.1}, 0.5);
      ASSERT_EQ(step(model, state, workspace, {.contacts = contacts}, {.step = h}).constraints.unsolved, 0);
      lowest = std::min(lowest, state.bodies[0].position.z());
    }
    EXPECT_GE(lowest, -1e-12);
    EXPECT_NEAR(state.bodies[0].position.z(), 0.0, 1e-12);
    EXPECT_LE(state.bodies[0].linear_momentum.norm(), kComplementarity);
  }
}

/// The forces that the constraints exerted, given as loads to a step without them, must make the same step.
TEST(Contact, ForcesReplayedAsLoads_MakeTheSameStep) {
  for (const RootKind root : {RootKind::kBall, RootKind::kFree, RootKind::kFixed}) {
    for (const double yield : {0.2, kInfinity}) {
      const Model model(bent_tree(root, yield));
      State state = initial_state(model);
      Workspace workspace(model);
      const std::vector<Contact> contacts = tree_contacts(model, state);
      const std::vector<Tie> ties = tree_ties(model, state);
      const Inputs inputs{.contacts = contacts, .ties = ties};
      const State before = state;
      const auto report = step(model, state, workspace, inputs, {.step = 2e-3});
      ASSERT_EQ(report.status, StepStatus::kOk);
      ASSERT_EQ(report.constraints.unsolved, 0);
      ASSERT_TRUE(report.converged);
      EXPECT_GE(report.constraints.acting, 3);
      const ReplayedForces loads(model, before, contacts, ties, workspace);
      State replayed = before;
      replayed.constraints.clear();
      ASSERT_TRUE(step(model, replayed, workspace, {.loads = &loads}, {.step = 2e-3}).converged);
      EXPECT_LE(largest_momentum_difference(state, replayed), kReplayTolerance);
    }
  }
}

TEST(Contact, TouchingTree_ObeysSignorinisAndCoulombsLaws) {
  const double h = 2e-3;
  const Model model(bent_tree(RootKind::kFree, 0.2));
  State state = initial_state(model);
  Workspace workspace(model);
  for (int n = 0; n < 50; ++n) {
    const std::vector<Contact> contacts = tree_contacts(model, state);
    const auto report = step(model, state, workspace, {.contacts = contacts}, {.step = h});
    ASSERT_EQ(report.constraints.unsolved, 0);
    ASSERT_TRUE(report.converged);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const Eigen::Vector3d force = workspace.contact_force(static_cast<int>(k));
      const double normal = force.dot(contacts[k].normal);
      const double tangential = (force - normal * contacts[k].normal).norm();
      EXPECT_GE(normal, 0.0);
      EXPECT_LE(tangential, contacts[k].friction * normal * (1.0 + 1e-9) + 1e-12);
    }
  }
}

}  // namespace
}  // namespace layfigure::testing
