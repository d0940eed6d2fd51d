#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "layfigure/dynamics/step.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

/// The doll of 52 joints, every third of which is welded: its body rides.
ModelDefinition doll_with_welds() {
  ModelDefinition definition = testing::load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json").definition;
  for (std::size_t i = 0; i < definition.bodies.size(); i += 3) {
    definition.bodies[i].joint.stiffness = INFINITY;
    definition.bodies[i].rest_rotation = definition.bodies[i].rotation;
  }
  return definition;
}

class Velocities : public ::testing::TestWithParam<bool> {};

TEST_P(Velocities, OfBodiesInMotion_AreTheRatesOfTheirPoses) {
  constexpr double kStep = 1e-6;
  // Of a step of 1e-6 s at speeds of up to some metres and some ten radians a second.
  constexpr double kTolerance = 1e-4;
  const Model model(GetParam() ? doll_with_welds()
                               : testing::load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json").definition);
  State state = initial_state(model);
  Workspace workspace(model);
  for (int n = 0; n < 200; ++n) ASSERT_EQ(step(model, state, workspace, {}, {.step = 1e-3}).status, StepStatus::kOk);
  std::vector<BodyPose> before, after;
  world_poses(model, state, before);
  ASSERT_EQ(step(model, state, workspace, {}, {.step = kStep}).status, StepStatus::kOk);
  world_poses(model, state, after);
  std::vector<BodyVelocity> velocities;
  std::vector<BodySpeed> speeds;
  world_velocities(model, state, workspace, after, velocities);
  world_speeds(model, state, workspace, after, speeds);
  double fastest = 0.0;
  for (int i = 0; i < model.size(); ++i) {
    const Eigen::AngleAxisd turn(after[i].rotation * before[i].rotation.conjugate());
    const Eigen::Vector3d angular = turn.angle() / kStep * turn.axis();
    EXPECT_LE((velocities[i].linear - (after[i].com - before[i].com) / kStep).norm(), kTolerance) << "body " << i;
    EXPECT_LE((velocities[i].angular - angular).norm(), kTolerance * (1.0 + angular.norm())) << "body " << i;
    EXPECT_NEAR(speeds[i].linear, velocities[i].linear.norm(), 1e-12 * (1.0 + speeds[i].linear));
    EXPECT_NEAR(speeds[i].angular, velocities[i].angular.norm(), 1e-12 * (1.0 + speeds[i].angular));
    fastest = std::max(fastest, speeds[i].linear);
  }
  EXPECT_GT(fastest, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Doll, Velocities, ::testing::Bool(),
                         [](const auto& welds) { return welds.param ? "WithWelds" : "AllMoving"; });

}  // namespace
}  // namespace layfigure::dynamics
