// Contact sets at the edge of having a solution.
#include <gtest/gtest.h>

#include <cmath>

#include "touching_scenes.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;
using scene::Scene;
using scene::SceneReport;

/// The doll on the floor with two balls, each held by a spring to a hand that pushes it into the chest from both sides
/// and down.
TEST(Wedge, DollBetweenTwoPointersAndTheFloor_StaysBoundedAndIsReported) {
  scene::SceneDefinition definition = capsule_doll(0.8, 8.0);
  for (const double side : {-1.0, 1.0}) {
    BodyDefinition& pointer = definition.model.bodies.emplace_back();
    pointer.name = side < 0.0 ? "right pointer" : "left pointer";
    pointer.anchor = {0.3 * side, 0.0, 0.4};
    pointer.mass = 0.1;
    pointer.inertia = 4e-5 * Eigen::Matrix3d::Identity();
    collision::ShapeDefinition& shape = definition.shapes.emplace_back();
    shape.name = pointer.name;
    shape.shape = collision::Sphere{.radius = 0.03};
    shape.body = static_cast<int>(definition.model.bodies.size()) - 1;
  }
  const int left = static_cast<int>(definition.model.bodies.size()) - 1;
  for (const double stiffness : {500.0, 1e5}) {
    Scene scene(definition);
    State state = initial_state(scene.model());
    std::vector<Coupling> hands(2);
    for (int k = 0; k < 2; ++k) {
      hands[k].body = left - 1 + k;
      hands[k].stiffness = stiffness;
      hands[k].damping = 0.1 * std::sqrt(stiffness);
    }
    double largest_force = 0.0;
    for (int n = 0; n < 2000; ++n) {
      const double t = n * 2e-3;
      for (int k = 0; k < 2; ++k) {
        const double side = k == 0 ? -1.0 : 1.0;
        // Through each other and into the floor: no contact set can follow.
        hands[k].target_position = {side * std::max(-0.05, 0.3 - 0.2 * t), 0.0, std::max(-0.05, 0.4 - 0.2 * t)};
      }
      const SceneReport report = scene.step(state, {.couplings = hands}, {.step = 2e-3});
      ASSERT_EQ(report.step.status, StepStatus::kOk);
      for (std::size_t c = 0; c < scene.contacts().size(); ++c) {
        largest_force = std::max(largest_force, scene.contact_force(static_cast<int>(c)).norm());
      }
      ASSERT_LT(energy(scene.model(), state).kinetic, 500.0) << "step " << n;
    }
    // The springs can press with k x, x at most half a metre; what the doll hits the floor with comes on top.
    EXPECT_LT(largest_force, 10.0 * (0.5 * stiffness + 1000.0));
    EXPECT_LE(overlap(scene, state), 0.02);
  }
}

/// Pointers as bodies without any give: fixed walls that close in. The rows contradict each other; the step must say so
/// and stay bounded.
TEST(Wedge, RigidWallsThatCloseOnABody_AreReportedAndBounded) {
  ModelDefinition definition;
  definition.root = RootKind::kFree;
  BodyDefinition& body = definition.bodies.emplace_back();
  body.name = "ball";
  body.inertia = 4e-3 * Eigen::Matrix3d::Identity();
  const Model model(definition);
  State state = initial_state(model);
  Workspace workspace(model);
  int unsolved = 0;
  for (int n = 0; n < 200; ++n) {
    std::vector<Contact> walls(2);
    for (int k = 0; k < 2; ++k) {
      const double side = k == 0 ? -1.0 : 1.0;
      const Eigen::Vector3d toward(-side, 0.0, 0.0);
      walls[k].normal = toward;
      walls[k].point_a = -0.1 * toward;
      walls[k].point_b = {side * (0.15 - 1e-3 * n), 0.0, 0.0};
      walls[k].surface_velocity = toward;
      walls[k].key = k;
    }
    const StepReport report = step(model, state, workspace, {.contacts = walls}, {.step = 1e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    unsolved += report.constraints.unsolved;
    ASSERT_LT(state.bodies[0].linear_momentum.norm(), 10.0);
  }
  EXPECT_GT(unsolved, 100);
  EXPECT_LE(std::abs(state.bodies[0].position.x()), 0.05) << "in the middle";
}

}  // namespace
}  // namespace layfigure::testing
