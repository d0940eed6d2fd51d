// The O(n) recursion against a dense solve of the same equations.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "dense_step.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

void expect_dense_agreement(const Model& model, const State& state, double tolerance) {
  const double h = 2e-3;
  const testing::DenseStep dense = testing::dense_step(model, state, h);
  const Eigen::VectorXd w = dense.matrix.ldlt().solve(dense.right);
  State next = state;
  Workspace workspace(model);
  ASSERT_EQ(step(model, next, workspace, {}, {.step = h}).status, StepStatus::kOk);
  const double scale = w.norm();
  for (int i = 0; i < model.size(); ++i) {
    const Eigen::Quaterniond turned = state.bodies[i].rotation.conjugate() * next.bodies[i].rotation;
    EXPECT_LT((math::log_rotation(turned) / h - w.segment<3>(3 * i)).norm(), tolerance * scale) << "joint " << i;
  }
}

State moving_state(const Model& model, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  State state = initial_state(model);
  for (int i = 0; i < model.size(); ++i) {
    BodyState& body = state.bodies[i];
    body.rotation = (body.rotation * math::exp_rotation(0.3 * vector())).normalized();
    body.linear_momentum = 0.3 * model.body(i).mass * vector();
    body.angular_momentum = model.body(i).inertia.diagonal().minCoeff() * vector();
  }
  return state;
}

TEST(DenseSolve, Doll_Agrees) {
  const testing::Scene scene = testing::load_scene(std::string(LAYFIGURE_TEST_DATA) + "/scenes/doll-52.json");
  const Model model(scene.definition);
  expect_dense_agreement(model, moving_state(model, 1), 1e-10);
}

TEST(DenseSolve, BentChainOf60_Agrees) {
  const Model model(testing::chain({.links = 60, .bend = 0.3}).definition);
  expect_dense_agreement(model, moving_state(model, 2), 1e-9);
}

TEST(DenseSolve, FreeDoll_Agrees) {
  testing::Scene scene = testing::load_scene(std::string(LAYFIGURE_TEST_DATA) + "/scenes/doll-52.json");
  scene.definition.root = RootKind::kFree;
  const Model model(scene.definition);
  expect_dense_agreement(model, moving_state(model, 4), 1e-10);
}

TEST(DenseSolve, StiffAndLooseJointsMixed_Agree) {
  testing::Scene scene = testing::chain({.links = 40, .bend = 0.2});
  for (std::size_t i = 0; i < scene.definition.bodies.size(); ++i) {
    scene.definition.bodies[i].joint.stiffness = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 1e3 : 1.0;
    scene.definition.bodies[i].joint.damping = i % 2 == 0 ? 0.0 : 0.1;
  }
  const Model model(scene.definition);
  expect_dense_agreement(model, moving_state(model, 3), 1e-9);
}

TEST(DenseSolve, JointsMildlyAndVeryAnisotropicMixed_Agree) {
  testing::Scene scene =
      testing::load_scene(std::string(LAYFIGURE_TEST_DATA) + "/scenes/doll-52.json");  // packs joints side by side
  for (std::size_t i = 0; i < scene.definition.bodies.size(); ++i) {
    JointLaw& joint = scene.definition.bodies[i].joint;
    if (i % 3 == 0) continue;  // isotropic
    joint.shape.stiffness = i % 3 == 1 ? Eigen::Vector3d(1.0, 0.2, 0.02) : Eigen::Vector3d(1.0, 1e4, 0.0);
    joint.shape.damping = i % 3 == 1 ? Eigen::Vector3d(0.1, 1.0, 0.3) : Eigen::Vector3d(1.0, 30.0, 0.5);
    joint.shape.axes = math::exp_rotation(Eigen::Vector3d(0.3, -1.1, 0.02 * static_cast<double>(i)));
  }
  const Model model(scene.definition);
  State state = moving_state(model, 5);
  for (BodyState& body : state.bodies) body.rest_rotation = body.rotation;
  expect_dense_agreement(model, state, 1e-10);
}

}  // namespace
}  // namespace layfigure::dynamics
