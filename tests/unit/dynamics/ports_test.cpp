#include "layfigure/dynamics/ports.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "constrained_scene.h"
#include "dense_step.h"
#include "layfigure/dynamics/step.h"
#include "random_vector.h"
#include "scene.h"

namespace layfigure::dynamics {
namespace {

using testing::bent_tree;
using testing::DenseStep;

constexpr double kStep = 2e-3;
// What the dense matrices' own inversion leaves.
constexpr double kDenseRounding = 1e-9;

double relative(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected) {
  return (found - expected).norm() / expected.norm();
}

/// The tree with joints that the dense matrices know.
ModelDefinition even_tree(RootKind root) {
  ModelDefinition definition = bent_tree(root, INFINITY);
  for (BodyDefinition& body : definition.bodies) body.joint.shape = {};
  return definition;
}

/// Velocities [angular; linear] of the ports' points for unit joint velocities.
Eigen::MatrixXd port_jacobian(const DenseStep& dense, std::span<const Port> ports) {
  Eigen::MatrixXd J(6 * ports.size(), dense.jacobian.cols());
  for (std::size_t k = 0; k < ports.size(); ++k) {
    const BodyPose& pose = dense.poses[ports[k].body];
    const Eigen::Vector3d way = pose.origin + pose.rotation * ports[k].point - pose.com;
    const auto body = dense.jacobian.middleRows<6>(6 * ports[k].body);
    for (int c = 0; c < J.cols(); ++c) {
      const Eigen::Vector3d w = body.col(c).head<3>();
      J.col(c).segment<6>(6 * k) = body.col(c);
      J.col(c).segment<3>(6 * k + 3) += w.cross(way);
    }
  }
  return J;
}

/// The definition with parts of its joints' laws left out.
ModelDefinition without(ModelDefinition definition, bool stiffness, bool damping) {
  for (BodyDefinition& body : definition.bodies) {
    if (stiffness) body.joint.stiffness = 0.0;
    if (damping) body.joint.damping = 0.0;
  }
  return definition;
}

Eigen::MatrixXd dense_response(const ModelDefinition& definition, const State& state, std::span<const Port> ports) {
  const DenseStep dense = testing::dense_step(Model(definition), state, kStep);
  const Eigen::MatrixXd J = port_jacobian(dense, ports);
  return J * dense.matrix.ldlt().solve(J.transpose());
}

const std::vector<Port> kPorts{{.body = 4, .point = {0.03, -0.02, 0.05}}, {.body = 8, .point = {0.0, 0.04, 0.0}}};

class PortResponses : public ::testing::TestWithParam<RootKind> {};

TEST_P(PortResponses, ElasticTree_AreThoseOfTheDenseMatrices) {
  const ModelDefinition definition = even_tree(GetParam());
  const Model model(definition);
  const State before = initial_state(model);
  State state = before;
  Workspace workspace(model);
  ASSERT_EQ(step(model, state, workspace, {}, {.step = kStep}).status, StepStatus::kOk);
  PortResponse response(model);
  ASSERT_TRUE(response.measure(model, before, workspace, kStep, kPorts));
  EXPECT_LE(relative(response.matrix(), dense_response(definition, before, kPorts)), kDenseRounding);
  EXPECT_LE(relative(response.damped_matrix(), dense_response(without(definition, true, false), before, kPorts)),
            kDenseRounding);
  EXPECT_LE(relative(response.inertial_matrix(), dense_response(without(definition, true, true), before, kPorts)),
            kDenseRounding);
}

TEST_P(PortResponses, VelocityAtTheEnd_IsThatOfTheDenseSolution) {
  const ModelDefinition definition = even_tree(GetParam());
  const Model model(definition);
  State before = initial_state(model);
  Workspace workspace(model);
  for (int k = 0; k < 5; ++k) (void)step(model, before, workspace, {}, {.step = kStep});
  State state = before;
  (void)step(model, state, workspace, {}, {.step = kStep});
  PortResponse response(model);
  ASSERT_TRUE(response.measure(model, before, workspace, kStep, kPorts));
  const DenseStep dense = testing::dense_step(model, before, kStep);
  const Eigen::VectorXd expected = port_jacobian(dense, kPorts) * dense.matrix.ldlt().solve(dense.right);
  EXPECT_LE(relative(response.velocity() + kStep * response.acceleration(), expected), kDenseRounding);
  for (int k = 0; k < 2; ++k) {
    const BodyPose& pose = dense.poses[kPorts[k].body];
    EXPECT_LE((response.position(k) - pose.origin - pose.rotation * kPorts[k].point).norm(), 1e-12);
    EXPECT_LE(response.rotation(k).angularDistance(pose.rotation), 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Roots, PortResponses, ::testing::Values(RootKind::kBall, RootKind::kFree));

/// The rows of the contacts that act, as the step's report of forces tells.
Eigen::MatrixXd contact_rows(const DenseStep& dense, const std::vector<Contact>& contacts, const Workspace& workspace) {
  std::vector<Eigen::RowVectorXd> rows;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& contact = contacts[i];
    const Eigen::Vector3d& force = workspace.contact_force(static_cast<int>(i));
    const double normal = force.dot(contact.normal);
    if (!(normal > 0.0)) continue;
    Eigen::MatrixXd J = port_jacobian(dense, std::vector<Port>{{contact.body_a, contact.point_a}}).bottomRows<3>();
    if (contact.body_b != kWorld) {
      J -= port_jacobian(dense, std::vector<Port>{{contact.body_b, contact.point_b}}).bottomRows<3>();
    }
    rows.emplace_back(contact.normal.transpose() * J);
    const Eigen::Vector3d tangential = force - normal * contact.normal;
    if (tangential.norm() > contact.friction * normal * (1.0 - 1e-6)) continue;
    const Eigen::Vector3d t = contact.normal.unitOrthogonal();
    rows.emplace_back(t.transpose() * J);
    rows.emplace_back(contact.normal.cross(t).transpose() * J);
  }
  Eigen::MatrixXd G(rows.size(), dense.jacobian.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) G.row(i) = rows[i];
  return G;
}

TEST(PortResponse, TreeInContact_ActingRowsAreTakenOut) {
  for (const double friction : {0.0, 0.3, 20.0}) {
    const ModelDefinition definition = even_tree(RootKind::kFree);
    const Model model(definition);
    const State before = initial_state(model);
    std::vector<Contact> contacts = testing::tree_contacts(model, before);
    for (Contact& contact : contacts) contact.friction = friction;
    State state = before;
    Workspace workspace(model);
    ASSERT_EQ(step(model, state, workspace, {.contacts = contacts}, {.step = kStep}).status, StepStatus::kOk);
    PortResponse response(model);
    ASSERT_TRUE(response.measure(model, before, workspace, kStep, kPorts));
    const DenseStep dense = testing::dense_step(model, before, kStep);
    const Eigen::MatrixXd G = contact_rows(dense, contacts, workspace);
    ASSERT_GT(G.rows(), 0);
    const Eigen::MatrixXd P = dense.matrix.inverse();
    const Eigen::MatrixXd D = G * P * G.transpose();
    const Eigen::MatrixXd held = P - P * G.transpose() * D.completeOrthogonalDecomposition().solve(G * P);
    const Eigen::MatrixXd J = port_jacobian(dense, kPorts);
    EXPECT_LE(relative(response.matrix(), J * held * J.transpose()), kDenseRounding) << "friction " << friction;
  }
}

/// A little push on port 0's point, added to the state's momenta.
State pushed(const Model& model, State state, const Eigen::Vector3d& impulse) {
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  const Port& port = kPorts[0];
  const Eigen::Vector3d point = poses[port.body].origin + poses[port.body].rotation * port.point;
  state.bodies[port.body].linear_momentum += impulse;
  state.bodies[port.body].angular_momentum += (point - poses[port.body].com).cross(impulse);
  return state;
}

struct Measured {
  Eigen::MatrixXd matrix, damped, inertial;
  Eigen::VectorXd end;
  int yielding;
};

Measured measured(const Model& model, const State& before, const Inputs& inputs, int order) {
  State state = before;
  Workspace workspace(model);
  const StepReport report = step(model, state, workspace, inputs, {.step = kStep, .order = order});
  PortResponse response(model);
  EXPECT_TRUE(response.measure(model, before, workspace, kStep, kPorts));
  return {.matrix = response.matrix(),
          .damped = response.damped_matrix(),
          .inertial = response.inertial_matrix(),
          .end = response.velocity() + kStep * response.acceleration(),
          .yielding = report.yielding};
}

TEST(PortResponse, JointsThatFlow_AreTheStepsOwnSlope) {
  ModelDefinition definition = bent_tree(RootKind::kBall, 1e-3);
  for (BodyDefinition& body : definition.bodies) body.joint.flow_damping = 0.02;
  definition.bodies[3].joint.shape.stiffness = {0.5, 1.0, 2.0};
  const Model model(definition);
  State before = initial_state(model);
  Workspace workspace(model);
  (void)step(model, before, workspace, {}, {.step = kStep});
  const Coupling pin{.body = 6, .stiffness = 300.0, .damping = 1.0};
  const Drive drive{.body = 2, .stiffness = 3.0, .damping = 0.01};
  const Inputs inputs{.couplings = {&pin, 1}, .drives = {&drive, 1}};
  const Measured base = measured(model, before, inputs, 1);
  ASSERT_GT(base.yielding, 0);
  // Far above rounding, far below what bends the law.
  constexpr double kImpulse = 1e-9;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d direction = Eigen::Vector3d::Unit(axis);
    const Measured next = measured(model, pushed(model, before, kImpulse * direction), inputs, 1);
    EXPECT_LE(relative((next.end - base.end) / kImpulse, base.matrix.col(3 + axis)), 1e-4);
  }
}

TEST(PortResponse, Matrices_FallFromMassToStep) {
  const Model model(bent_tree(RootKind::kFree, 0.05));
  const State before = initial_state(model);
  for (const int order : {1, 3}) {
    const Measured found = measured(model, before, {}, order);
    const Eigen::MatrixXd spring = found.damped - found.matrix;
    const Eigen::MatrixXd damper = found.inertial - found.damped;
    const double rounding = 1e-10 * found.inertial.norm();
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(spring).eigenvalues().minCoeff(), -rounding);
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(damper).eigenvalues().minCoeff(), -rounding);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(found.matrix).eigenvalues().minCoeff(), 0.0);
    EXPECT_LE(relative(found.matrix, found.matrix.transpose()), 1e-15);
  }
}

TEST(PortResponse, WithoutFactors_IsRefused) {
  const Model model(bent_tree(RootKind::kBall, INFINITY));
  const State before = initial_state(model);
  State state = before;
  Workspace workspace(model);
  PortResponse response(model);
  EXPECT_FALSE(response.measure(model, before, workspace, kStep, kPorts)) << "no step yet";
  (void)step(model, state, workspace, {}, {.step = kStep});
  EXPECT_TRUE(response.measure(model, before, workspace, kStep, kPorts));
  EXPECT_FALSE(response.measure(model, before, workspace, kStep, kPorts)) << "used up";
}

TEST(PortResponse, BodyThatRides_IsItsCarriers) {
  ModelDefinition definition = bent_tree(RootKind::kBall, INFINITY);
  definition.bodies[4].joint.stiffness = INFINITY;
  const Model model(definition);
  const State before = initial_state(model);
  const Measured riding = measured(model, before, {}, 1);
  ModelDefinition stiff = definition;
  stiff.bodies[4].joint.stiffness = 0.99 * kRigidStiffness;
  const Measured held = measured(Model(stiff), initial_state(Model(stiff)), {}, 1);
  EXPECT_LE(relative(riding.matrix, held.matrix), 1e-6);
}

TEST(PortResponse, MeasuringAfterEveryStep_ChangesNoBit) {
  const Model model(bent_tree(RootKind::kFree, 0.05));
  State plain = initial_state(model);
  State watched = plain;
  Workspace a(model);
  Workspace b(model);
  PortResponse response(model);
  for (int k = 0; k < 50; ++k) {
    const State before = watched;
    (void)step(model, plain, a, {}, {.step = kStep});
    (void)step(model, watched, b, {}, {.step = kStep});
    ASSERT_TRUE(response.measure(model, before, b, kStep, kPorts));
  }
  for (int i = 0; i < model.size(); ++i) {
    EXPECT_EQ(plain.bodies[i].rotation.coeffs(), watched.bodies[i].rotation.coeffs());
    EXPECT_EQ(plain.bodies[i].linear_momentum, watched.bodies[i].linear_momentum);
  }
}

}  // namespace
}  // namespace layfigure::dynamics
