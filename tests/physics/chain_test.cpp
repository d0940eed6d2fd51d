// Deep chains in 3-D: where an unsymmetrised recursion fails.
#include <gtest/gtest.h>

#include "layfigure/math/rotation.h"
#include "scene.h"

namespace layfigure::testing {
namespace {

TEST(DeepChain, Of60BentIn3D_IsStableAtEveryStep) {
  const Scene scene = chain({.links = 60, .bend = 0.3});
  const dynamics::Model model(scene.definition);
  const double start = dynamics::energy(model, dynamics::initial_state(model)).total();
  const double stored = dynamics::energy(model, dynamics::initial_state(model)).elastic;
  for (const int order : {1, 2, 3, 4}) {
    for (const int steps : {30, 120, 1000}) {
      const RunResult run = run_scene(scene, model, steps, order);
      ASSERT_TRUE(run.finite) << "order " << order << ", " << steps << " steps";
      // Extrapolated steps may add a little energy: a hundredth of what the strained joints held.
      EXPECT_LT(dynamics::energy(model, run.state).total(), start + 0.01 * stored);
    }
  }
}

TEST(DeepChain, Of60_TurnedWorldAndMirroredWorld_Agree) {
  const Scene scene = chain({.links = 60, .bend = 0.3});
  const RunResult run = run_scene(scene, dynamics::Model(scene.definition), 100, 2);

  const Eigen::Quaterniond turn = math::exp_rotation({0.4, -1.1, 0.7});
  Scene turned = scene;
  turned.definition.gravity = turn * scene.definition.gravity;
  // The root's joint turns with the world, and so does its rest rotation.
  turned.definition.bodies[0].rotation = turn * scene.definition.bodies[0].rotation;
  turned.definition.bodies[0].rest_rotation = turn;
  const RunResult other = run_scene(turned, dynamics::Model(turned.definition), 100, 2);

  Scene mirrored = scene;  // y -> -y: rotation vectors change sign in x and z
  for (auto& body : mirrored.definition.bodies) {
    Eigen::Quaterniond& q = body.rotation;
    q = Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z());
  }
  const RunResult mirror = run_scene(mirrored, dynamics::Model(mirrored.definition), 100, 2);

  for (int i = 0; i < 60; ++i) {
    EXPECT_LT((turn * run.coms[i] - other.coms[i]).norm(), 1e-8) << i;
    const Eigen::Vector3d flipped(run.coms[i].x(), -run.coms[i].y(), run.coms[i].z());
    EXPECT_LT((flipped - mirror.coms[i]).norm(), 1e-8) << i;
  }
}

TEST(DeepChain, Of10000_Steps) {
  Scene scene = chain({.links = 10000});
  scene.duration = 0.05;
  EXPECT_TRUE(run_scene(scene, dynamics::Model(scene.definition), 20, 1).finite);
}

}  // namespace
}  // namespace layfigure::testing
