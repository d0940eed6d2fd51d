// The O(n) recursion against a dense solve of the same equations.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

/// J: columns the world velocities (w_WB, v at the com) of all bodies for unit relative velocities in the child's axes.
Eigen::MatrixXd jacobian(const Model& model, const std::vector<BodyPose>& poses) {
  const int n = model.size();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6 * n, 3 * n);
  for (int i = 0; i < n; ++i) {
    for (int j = i; j >= 0; j = model.body(j).parent) {
      const Eigen::Matrix3d R = poses[j].rotation.toRotationMatrix();
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d axis = R.col(k);
        J.block<3, 1>(6 * i, 3 * j + k) = axis;
        J.block<3, 1>(6 * i + 3, 3 * j + k) = axis.cross(poses[i].com - poses[j].origin);
      }
    }
  }
  return J;
}

/// Solves J^T (M J w - P - h F) + h t(w) = 0 for elastic joints, densely.
Eigen::VectorXd dense_velocities(const Model& model, const State& state, double h) {
  const int n = model.size();
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  const Eigen::MatrixXd J = jacobian(model, poses);
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  Eigen::VectorXd P(6 * n), residual(3 * n);
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (int i = 0; i < n; ++i) {
    const BodyDefinition& body = model.body(i);
    const Eigen::Matrix3d R = poses[i].rotation.toRotationMatrix();
    M.block<3, 3>(6 * i, 6 * i) = R * body.inertia * R.transpose();
    M.block<3, 3>(6 * i + 3, 6 * i + 3) = body.mass * Eigen::Matrix3d::Identity();
    P.segment<3>(6 * i) = state.bodies[i].angular_momentum;
    P.segment<3>(6 * i + 3) = state.bodies[i].linear_momentum + h * body.mass * model.gravity();
    const JointLaw& law = body.joint;
    const auto strain = math::log_rotation(state.bodies[i].rest_rotation.conjugate() * state.bodies[i].rotation);
    G.block<3, 3>(3 * i, 3 * i) = h * (h * law.stiffness + law.damping) * Eigen::Matrix3d::Identity();
    residual.segment<3>(3 * i) = -h * law.stiffness * strain;
  }
  return (J.transpose() * M * J + G).ldlt().solve(J.transpose() * P + residual);
}

void expect_dense_agreement(const Model& model, const State& state, double tolerance) {
  const double h = 2e-3;
  const Eigen::VectorXd w = dense_velocities(model, state, h);
  State next = state;
  Workspace workspace(model);
  ASSERT_EQ(step(model, next, workspace, {}, {.step = h}).status, StepStatus::kOk);
  double scale = w.norm();
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

TEST(DenseSolve, StiffAndLooseJointsMixed_Agree) {
  testing::Scene scene = testing::chain({.links = 40, .bend = 0.2});
  for (std::size_t i = 0; i < scene.definition.bodies.size(); ++i) {
    scene.definition.bodies[i].joint.stiffness = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 1e3 : 1.0;
    scene.definition.bodies[i].joint.damping = i % 2 == 0 ? 0.0 : 0.1;
  }
  const Model model(scene.definition);
  expect_dense_agreement(model, moving_state(model, 3), 1e-9);
}

}  // namespace
}  // namespace layfigure::dynamics
