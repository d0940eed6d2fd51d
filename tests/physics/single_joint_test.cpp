// One joint with inertia about a fixed axis is a linear ODE: compared with its matrix exponential.
#include <gtest/gtest.h>

#include <unsupported/Eigen/MatrixFunctions>

#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"

namespace layfigure::dynamics {
namespace {

constexpr double kInertia = 0.02;
constexpr double kStiffness = 3.0;
constexpr double kDamping = 0.05;
constexpr double kFlowDamping = 0.4;
constexpr double kStart = 0.5;
constexpr double kDuration = 0.8;
const Eigen::Vector3d kAxis = Eigen::Vector3d(2.0, -1.0, 2.0) / 3.0;

Model joint(double yield) {
  ModelDefinition definition;
  definition.gravity.setZero();
  BodyDefinition body;
  body.inertia = kInertia * Eigen::Matrix3d::Identity();
  body.rotation = math::exp_rotation(kStart * kAxis);
  body.joint = {.stiffness = kStiffness, .damping = kDamping, .flow_damping = kFlowDamping, .yield_torque = yield};
  definition.bodies.push_back(body);
  return Model(definition);
}

/// Distance from the expected angle and angular velocity; the period of about 0.5 s makes their units comparable.
double error_at_end(const Model& model, int steps, int order, const Eigen::Vector2d& expected) {
  State state = initial_state(model);
  Workspace workspace(model);
  for (int k = 0; k < steps; ++k) {
    EXPECT_EQ(step(model, state, workspace, {}, {.step = kDuration / steps, .order = order}).status, StepStatus::kOk);
  }
  const double angle = math::log_rotation(state.bodies[0].rotation).dot(kAxis);
  const double rate = state.bodies[0].angular_momentum.dot(kAxis) / kInertia;
  return (Eigen::Vector2d(angle, rate) - expected).norm();
}

void expect_orders(const Model& model, const Eigen::Vector2d& expected) {
  for (const int order : {1, 2, 3, 4}) {
    const int steps = 640;
    const double coarse = error_at_end(model, steps, order, expected);
    const double fine = error_at_end(model, 2 * steps, order, expected);
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.15) << "order " << order << ": " << coarse << " -> " << fine;
  }
}

TEST(SingleJoint, Elastic_ConvergesToTheMatrixExponential) {
  // x = (q, w)
  Eigen::Matrix2d A;
  A << 0.0, 1.0, -kStiffness / kInertia, -kDamping / kInertia;
  const Eigen::Vector2d x = (A * kDuration).exp() * Eigen::Vector2d(kStart, 0.0);
  expect_orders(joint(std::numeric_limits<double>::infinity()), x);
}

TEST(SingleJoint, ThreeElement_ConvergesToTheMatrixExponential) {
  // x = (q, q_f, w): t = K q_f + D_f w_f = D_d (w - w_f), I dw = -t
  const double sum = kDamping + kFlowDamping;
  Eigen::Matrix3d A;
  A << 0.0, 0.0, 1.0,                              //
      0.0, -kStiffness / sum, kFlowDamping / sum,  //
      0.0, -kFlowDamping * kStiffness / sum / kInertia, -kFlowDamping * kDamping / sum / kInertia;
  const Eigen::Vector3d x = (A * kDuration).exp() * Eigen::Vector3d(kStart, kStart, 0.0);
  expect_orders(joint(0.0), {x[0], x[2]});
}

}  // namespace
}  // namespace layfigure::dynamics
