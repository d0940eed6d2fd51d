// Ties: closed loops, rigid, compliant and limited in force.
#include <gtest/gtest.h>

#include <cmath>

#include "constrained_scene.h"
#include "layfigure/math/rotation.h"
#include "scene.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

Eigen::Vector3d tie_gap(const Model& model, const State& state, const Tie& tie) {
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  return world_point(poses, tie.body_a, tie.point_a) - world_point(poses, tie.body_b, tie.point_b);
}

/// Largest gap of a closed loop while the tree falls into it.
double largest_gap(const Model& model, double h) {
  State state = initial_state(model);
  Workspace workspace(model);
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  std::vector<Tie> ties(3);
  ties[0] = {.body_a = 6, .point_a = model.body(6).com, .point_b = poses[6].com};
  ties[1] = {.body_a = 7, .point_a = model.body(7).com, .point_b = poses[7].com};
  ties[2] = {.body_a = 5, .body_b = 8, .point_a = model.body(5).com};
  ties[2].point_b = poses[8].rotation.conjugate() * (poses[5].com - poses[8].origin);
  double largest = 0.0;
  for (int n = 0; n * h < 1.0; ++n) {
    const auto report = step(model, state, workspace, {.ties = ties}, {.step = h});
    EXPECT_EQ(report.status, StepStatus::kOk);
    EXPECT_EQ(report.constraints.unsolved, 0);
    for (const Tie& tie : ties) largest = std::max(largest, tie_gap(model, state, tie).norm());
  }
  return largest;
}

TEST(Tie, HandsPinnedAndHandOnHip_KeepClosedWhileTheTreeMoves) {
  // What the rotation within a step leaves open, |w h|^2 r / 2, is undone over kRecoveryTime: a gap of the order of
  // w^2 r h kRecoveryTime / 2.
  const Model model(bent_tree(RootKind::kFree, 0.3));
  const double coarse = largest_gap(model, 1e-3);
  const double fine = largest_gap(model, 2.5e-4);
  EXPECT_LE(coarse, 1e-3);
  EXPECT_LE(fine, 0.4 * coarse);
}

TEST(Tie, ClosedLoops_KeepTheOrderOfTheSteps) {
  ModelDefinition definition = bent_tree(RootKind::kFixed, std::numeric_limits<double>::infinity());
  definition.bodies[4].joint.shape.locked = {false, false, false};
  const Model model(definition);
  const State start = initial_state(model);
  const std::vector<Tie> ties = tree_ties(model, start);
  const auto end = [&](int order, int steps) {
    State state = start;
    Workspace workspace(model);
    for (int n = 0; n < steps; ++n) {
      const StepReport report = step(model, state, workspace, {.ties = ties}, {.step = 0.05 / steps, .order = order});
      EXPECT_EQ(report.extrapolated, order > 1);
    }
    return state;
  };
  const State exact = end(4, 1600);
  for (int order = 1; order <= 4; ++order) {
    const double coarse = largest_momentum_difference(end(order, 100), exact);
    const double fine = largest_momentum_difference(end(order, 200), exact);
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.3) << "order " << order << ": " << coarse << " -> " << fine;
  }
}

TEST(Tie, Spring_IsThatOfACoupling) {
  // An unbounded compliant tie to the world and a coupling are the same rows, solved in two ways.
  const Model model(bent_tree(RootKind::kBall, std::numeric_limits<double>::infinity()));
  const State start = initial_state(model);
  std::vector<BodyPose> poses;
  world_poses(model, start, poses);
  Tie tie{.body_a = 6, .point_a = {0.02, 0.01, 0.0}, .stiffness = 3e4, .damping = 20.0};
  tie.point_b = world_point(poses, 6, tie.point_a) + Eigen::Vector3d(0.01, 0.0, 0.02);
  tie.holds_rotation = true;
  tie.rotation = math::exp_rotation(Eigen::Vector3d(0.1, 0.0, -0.1)) * poses[6].rotation;
  tie.angular_stiffness = 50.0;
  tie.angular_damping = 0.1;
  Coupling coupling{.body = 6,
                    .point = tie.point_a,
                    .stiffness = tie.stiffness,
                    .damping = tie.damping,
                    .angular_stiffness = tie.angular_stiffness,
                    .angular_damping = tie.angular_damping,
                    .target_position = tie.point_b,
                    .target_rotation = tie.rotation};
  State tied = start;
  State coupled = start;
  Workspace workspace(model);
  for (int n = 0; n < 100; ++n) {
    ASSERT_EQ(step(model, tied, workspace, {.ties = {&tie, 1}}, {.step = 1e-3}).constraints.unsolved, 0);
    const BodyForce force = workspace.tie_force(0);
    (void)step(model, coupled, workspace, {.couplings = {&coupling, 1}}, {.step = 1e-3});
    EXPECT_LE((force.force - workspace.coupling_force(0).force).norm(), 1e-7 * force.force.norm());
    EXPECT_LE((force.torque - workspace.coupling_force(0).torque).norm(), 1e-7 * force.force.norm());
  }
  EXPECT_LE(largest_momentum_difference(tied, coupled), 1e-8);
}

TEST(Tie, WithALargestForce_GivesWay) {
  const Model model(block(2.0, {0.1, 0.1, 0.1}, {0.0, 0.0, -9.81}));
  State state = initial_state(model);
  Workspace workspace(model);
  Tie tie{.body_a = 0, .point_a = model.body(0).com, .point_b = model.body(0).com, .max_force = 15.0};
  for (int n = 0; n < 500; ++n) {
    ASSERT_EQ(step(model, state, workspace, {.ties = {&tie, 1}}, {.step = 1e-3}).constraints.unsolved, 0);
  }
  EXPECT_NEAR(workspace.tie_force(0).force.z(), 15.0, 1e-9);
  EXPECT_NEAR(state.bodies[0].linear_momentum.z(), -(2.0 * 9.81 - 15.0) * 0.5, 1e-9);
  tie.max_force = 20.0;
  tie.point_b = tie.point_a + state.bodies[0].position;
  state.bodies[0].linear_momentum.setZero();
  const Eigen::Vector3d held = state.bodies[0].position;
  for (int n = 0; n < 500; ++n) (void)step(model, state, workspace, {.ties = {&tie, 1}}, {.step = 1e-3});
  EXPECT_LE((state.bodies[0].position - held).norm(), 1e-10);
  EXPECT_NEAR(workspace.tie_force(0).force.z(), 2.0 * 9.81, 1e-8);
}

TEST(Tie, ContradictoryTies_GiveABoundedReportedAnswer) {
  const Model model(block(1.0, {0.1, 0.1, 0.1}, {0.0, 0.0, -9.81}));
  State state = initial_state(model);
  Workspace workspace(model);
  std::vector<Tie> ties(2);
  ties[0] = {.body_a = 0, .point_b = {0.0, 0.0, 0.0}};
  ties[1] = {.body_a = 0, .point_b = {1.0, 0.0, 0.0}};
  int unsolved = 0;
  for (int n = 0; n < 200; ++n) {
    const auto report = step(model, state, workspace, {.ties = ties}, {.step = 1e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    unsolved += report.constraints.unsolved;
  }
  EXPECT_GT(unsolved, 0) << "the contradiction must be reported";
  EXPECT_GE(state.bodies[0].position.x(), 0.0) << "it must be between the two";
  EXPECT_LE(state.bodies[0].position.x(), 1.0);
  EXPECT_LE(state.bodies[0].linear_momentum.norm(), 1.0 * kLargestClosingSpeed);
}

}  // namespace
}  // namespace layfigure::testing
