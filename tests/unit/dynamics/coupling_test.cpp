#include <gtest/gtest.h>

#include <cmath>

#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

ModelDefinition free_body() {
  ModelDefinition definition;
  definition.root = RootKind::kFree;
  definition.bodies.resize(1);
  definition.bodies[0].mass = 2.0;
  definition.bodies[0].com = {0.1, 0.0, 0.0};
  definition.bodies[0].inertia = 0.01 * Eigen::Matrix3d::Identity();
  return definition;
}

TEST(Coupling, HangingBody_RestsWhereTheSpringCarriesIt) {
  const Model model(free_body());
  State state = initial_state(model);
  Workspace workspace(model);
  const Coupling coupling{.body = 0, .point = {0.1, 0.0, 0.0}, .stiffness = 500.0, .damping = 60.0};
  for (int k = 0; k < 5000; ++k) {
    ASSERT_EQ(step(model, state, workspace, {.couplings = {&coupling, 1}}, {.step = 1e-3}).status, StepStatus::kOk);
  }
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  EXPECT_NEAR(poses[0].com.z(), -2.0 * 9.81 / 500.0, 1e-9);
  EXPECT_NEAR(workspace.coupling_force(0).force.z(), 2.0 * 9.81, 1e-7);
}

TEST(Coupling, SixDof_TurnsTheBodyToItsTarget) {
  ModelDefinition definition = free_body();
  definition.gravity.setZero();
  const Model model(definition);
  State state = initial_state(model);
  Workspace workspace(model);
  Coupling coupling{.body = 0, .stiffness = 500.0, .damping = 60.0, .angular_stiffness = 5.0, .angular_damping = 0.5};
  coupling.target_rotation = math::exp_rotation({0.5, 1.0, -0.4});
  coupling.target_position = {0.3, -0.2, 0.1};
  for (int k = 0; k < 8000; ++k) {
    ASSERT_EQ(step(model, state, workspace, {.couplings = {&coupling, 1}}, {.step = 1e-3}).status, StepStatus::kOk);
  }
  EXPECT_LT(math::log_rotation(state.bodies[0].rotation.conjugate() * coupling.target_rotation).norm(), 1e-6);
  EXPECT_LT((state.bodies[0].position - coupling.target_position).norm(), 1e-6);
}

TEST(Coupling, AnyStiffnessAndStep_StaysStable) {
  const testing::Scene scene = testing::chain({.links = 10, .bend = 0.3});
  const Model model(scene.definition);
  for (const double stiffness : {1.0, 1e4, 1e9}) {
    for (const double h : {1e-5, 1e-3, 0.1}) {
      State state = initial_state(model);
      Workspace workspace(model);
      Coupling coupling{.body = 9, .point = {0.1, 0.0, 0.0}, .stiffness = stiffness, .damping = 1.0};
      coupling.target_position = {0.3, 0.4, 0.5};
      for (int k = 0; k < 200; ++k) {
        ASSERT_EQ(step(model, state, workspace, {.couplings = {&coupling, 1}}, {.step = h}).status, StepStatus::kOk);
      }
      const Energy now = energy(model, state);
      // The spring can put in no more than it stored when it was attached, at a distance of about 1 m.
      EXPECT_LT(now.kinetic + now.elastic, 2.0 * stiffness + 100.0) << stiffness << " N/m, h = " << h;
    }
  }
}

TEST(Coupling, MovingTarget_IsFollowedWithoutLag) {
  ModelDefinition definition = free_body();
  definition.gravity.setZero();
  const Model model(definition);
  State state = initial_state(model);
  Workspace workspace(model);
  Coupling coupling{.body = 0, .point = {0.1, 0.0, 0.0}, .stiffness = 5000.0, .damping = 200.0};
  coupling.target_velocity = {0.2, 0.0, 0.0};
  const double h = 1e-3;
  for (int k = 0; k < 5000; ++k) {
    coupling.target_position = Eigen::Vector3d(0.1, 0.0, 0.0) + k * h * coupling.target_velocity;
    ASSERT_EQ(step(model, state, workspace, {.couplings = {&coupling, 1}}, {.step = h}).status, StepStatus::kOk);
  }
  EXPECT_NEAR(state.bodies[0].position.x(), 5000 * h * 0.2, 1e-9);
}

}  // namespace
}  // namespace layfigure::dynamics
