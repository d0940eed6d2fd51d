// Contacts in the step: resting, sliding, friction's cone, impacts, trees that touch.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "constrained_scene.h"
#include "same_bits.h"

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

TEST(Contact, ThatDoesNotAct_ChangesNoBitAndHasNoRows) {
  const Model model(block(1.0, {0.1, 0.2, 0.1}, {0.0, 0.0, -kG}));
  for (const int order : {1, 4}) {
    State with = initial_state(model);
    with.bodies[0].position.z() = 0.5;
    with.bodies[0].angular_momentum = {0.01, -0.02, 0.03};
    State without = with;
    Workspace workspace(model);
    const auto contacts = corner_contacts({0.1, 0.2, 0.1}, 0.5);
    for (int n = 0; n < 100; ++n) {
      const auto report = step(model, with, workspace, {.contacts = contacts}, {.step = 1e-3, .order = order});
      ASSERT_EQ(report.constraints.rows, 0);
      ASSERT_EQ(step(model, without, workspace, {}, {.step = 1e-3, .order = order}).status, StepStatus::kOk);
      ASSERT_EQ(first_difference(with, without), "") << "order " << order << ", step " << n;
    }
  }
}

/// A plate that comes down on one corner, which makes it turn: only then does the opposite one reach its own floor.
TEST(Contact, ThatAnImpulseBringsAbout_IsSolvedInTheSameStep) {
  const double h = 0.01;
  const double speed = 0.4;
  const std::array<double, 4> gaps{0.0, 3.5e-3, 3.5e-3, 6e-3};
  const Model model(block(1.0, {0.1, 0.1, 0.01}, {0.0, 0.0, 0.0}));
  State state = initial_state(model);
  state.bodies[0].linear_momentum.z() = -speed;
  auto contacts = corner_contacts({0.1, 0.1, 0.01}, 0.0);
  for (int k = 0; k < 4; ++k) contacts[k].point_b.z() = -gaps[k];
  ASSERT_GT(gaps[3], speed * h);
  Workspace workspace(model);
  const auto report = step(model, state, workspace, {.contacts = contacts}, {.step = h});
  EXPECT_EQ(report.constraints.unsolved, 0);
  EXPECT_EQ(report.constraints.rows, 4);
  EXPECT_EQ(report.constraints.acting, 2);
  EXPECT_GT(workspace.contact_force(0).z(), 0.0);
  EXPECT_GT(workspace.contact_force(3).z(), 0.0);
  // The corners' velocities: they end on their floors.
  const Eigen::Vector3d v = state.bodies[0].linear_momentum;
  const Eigen::Vector3d w = model.body(0).inertia.ldlt().solve(state.bodies[0].angular_momentum);
  EXPECT_NEAR((v + w.cross(contacts[0].point_a)).z(), 0.0, kComplementarity);
  EXPECT_NEAR((v + w.cross(contacts[3].point_a)).z(), -gaps[3] / h, kComplementarity);
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

/// Velocity of a material point in a step, from the momenta that the step left; `poses` are those before it.
Eigen::Vector3d step_velocity(const Model& model, const std::vector<BodyPose>& poses, const State& after, int body,
                              const Eigen::Vector3d& position) {
  if (body == kWorld) return Eigen::Vector3d::Zero();
  const BodyState& state = after.bodies[body];
  const Eigen::Quaterniond& R = poses[body].rotation;
  const Eigen::Vector3d w = R * (model.body(body).inertia.inverse() * (R.conjugate() * state.angular_momentum));
  return state.linear_momentum / model.body(body).mass + w.cross(position - poses[body].com);
}

TEST(Contact, TouchingTree_ObeysSignorinisAndCoulombsLaws) {
  const double h = 2e-3;
  const Model model(bent_tree(RootKind::kFree, 0.2));
  State state = initial_state(model);
  Workspace workspace(model);
  int sliding = 0;
  int sticking = 0;
  for (int n = 0; n < 50; ++n) {
    std::vector<BodyPose> poses;
    world_poses(model, state, poses);
    const std::vector<Contact> contacts = tree_contacts(model, state);
    const StepReport report = step(model, state, workspace, {.contacts = contacts}, {.step = h});
    ASSERT_EQ(report.constraints.unsolved, 0);
    ASSERT_TRUE(report.converged);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const Contact& contact = contacts[k];
      const Eigen::Vector3d position = world_point(poses, contact.body_a, contact.point_a);
      const Eigen::Vector3d velocity = step_velocity(model, poses, state, contact.body_a, position) -
                                       step_velocity(model, poses, state, contact.body_b, position);
      const Eigen::Vector3d force = workspace.contact_force(static_cast<int>(k));
      const double force_n = force.dot(contact.normal);
      const double velocity_n = velocity.dot(contact.normal);
      const Eigen::Vector3d force_t = force - force_n * contact.normal;
      const Eigen::Vector3d velocity_t = velocity - velocity_n * contact.normal;
      // The points are chosen with a gap of zero.
      EXPECT_GE(force_n, 0.0);
      EXPECT_GE(velocity_n, -kComplementarity);
      EXPECT_LE(std::min(force_n, velocity_n), kComplementarity);
      EXPECT_LE(force_t.norm(), contact.friction * force_n * (1.0 + 1e-9) + kComplementarity);
      if (force_n < kComplementarity || contact.friction == 0.0) continue;
      const bool slides = velocity_t.norm() > 1e-6;
      (slides ? sliding : sticking) += 1;
      if (!slides) continue;
      EXPECT_LE((force_t + contact.friction * force_n * velocity_t.normalized()).norm(), 1e-6 * force_n);
    }
  }
  EXPECT_GT(sliding, 20);
  EXPECT_GT(sticking, 20);
}

TEST(Contact, ImpactWithinAStep_IsNotExtrapolated) {
  const Model model(block(1.0, {0.1, 0.1, 0.1}, {0.0, 0.0, -kG}));
  State state = initial_state(model);
  state.bodies[0].position.z() = 0.002;
  state.bodies[0].linear_momentum.z() = -0.5;
  Workspace workspace(model);
  const auto contacts = corner_contacts({0.1, 0.1, 0.1}, 0.5);
  const StepReport report = step(model, state, workspace, {.contacts = contacts}, {.step = 0.01, .order = 4});
  EXPECT_FALSE(report.extrapolated);
  EXPECT_NEAR(state.bodies[0].position.z(), 0.0, 1e-12) << "it lies on the floor, not over or under it";
  const StepReport later = step(model, state, workspace, {.contacts = contacts}, {.step = 0.01, .order = 4});
  EXPECT_TRUE(later.extrapolated);
}

TEST(Contact, Ledger_CountsWhatFrictionTakes) {
  // A block thrown along the floor: all its energy goes into friction.
  const Model model(block(2.0, {0.1, 0.1, 0.02}, {0.0, 0.0, -kG}));
  State state = initial_state(model);
  state.bodies[0].linear_momentum.x() = 3.0;
  Workspace workspace(model);
  const auto contacts = corner_contacts({0.1, 0.1, 0.02}, 0.3);
  const double energy_before = energy(model, state).total();
  double taken = 0.0;
  double created = 0.0;
  for (int n = 0; n < 1000; ++n) {
    const double before = energy(model, state).total();
    auto moved = contacts;
    for (Contact& contact : moved) contact.point_b += state.bodies[0].position;
    const StepReport report = step(model, state, workspace, {.contacts = moved}, {.step = 1e-3});
    taken += report.work.constraints;
    created = std::max(created, energy(model, state).total() - before + report.work.constraints);
  }
  EXPECT_LE(state.bodies[0].linear_momentum.norm(), kComplementarity);
  EXPECT_NEAR(taken, energy_before - energy(model, state).total(), 2e-2 * taken);
  EXPECT_LE(created, 1e-12);
}

}  // namespace
}  // namespace layfigure::testing
