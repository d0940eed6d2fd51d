// The joint law axis by axis: anisotropy, locks, hardening, softness and the limits of the parameters.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"

namespace layfigure::dynamics {
namespace {

const Eigen::Quaterniond kSection = math::exp_rotation({0.3, -0.8, 0.5});

BodyDefinition body_with(const JointLaw& law) {
  BodyDefinition body;
  body.mass = 0.1;
  body.inertia = 1e-3 * Eigen::Matrix3d::Identity();
  body.joint = law;
  return body;
}

Model joint_model(const JointLaw& law, FlowLaw kind = FlowLaw::kPaper) {
  ModelDefinition definition;
  definition.gravity.setZero();
  definition.law = kind;
  definition.bodies.push_back(body_with(law));
  return Model(definition);
}

/// Rises slowly enough that inertia adds nothing to it.
class Torque : public Loads {
 public:
  Torque(double start, double rise, const Eigen::Vector3d& torque) : start_(start), rise_(rise), torque_(torque) {}
  void add(double time, std::span<BodyForce> forces) const override {
    forces[0].torque += std::min(1.0, (time - start_) / rise_) * torque_;
  }

 private:
  double start_;
  double rise_;
  Eigen::Vector3d torque_;
};

void apply(const Model& model, State& state, const Eigen::Vector3d& torque, double seconds) {
  Workspace workspace(model);
  const Torque load(state.time, 0.5 * seconds, torque);
  for (int k = 0; k < std::lround(seconds / 1e-3); ++k) {
    const StepReport report = step(model, state, workspace, {.loads = &load}, {.step = 1e-3});
    ASSERT_EQ(report.status, StepStatus::kOk);
    ASSERT_TRUE(report.converged);
  }
}

Eigen::Vector3d angle(const State& state) { return math::log_rotation(state.bodies[0].rotation); }
Eigen::Vector3d rest(const State& state) { return math::log_rotation(state.bodies[0].rest_rotation); }

JointLaw anisotropic() {
  JointLaw law{.stiffness = 2.0, .damping = 0.1, .flow_damping = 0.5};
  law.shape.axes = kSection;
  law.shape.stiffness = {0.5, 1.0, 3.0};
  return law;
}

TEST(JointAxes, EachSectionAxis_HasItsOwnStiffness) {
  const JointLaw law = anisotropic();
  const Model model(joint_model(law));
  for (int axis = 0; axis < 3; ++axis) {
    State state = initial_state(model);
    const Eigen::Vector3d direction = kSection * Eigen::Vector3d::Unit(axis);
    apply(model, state, 0.05 * direction, 5.0);
    const Eigen::Vector3d expected = 0.05 / (2.0 * law.shape.stiffness[axis]) * direction;
    EXPECT_LT((angle(state) - expected).norm(), 1e-9) << "axis " << axis;
  }
}

TEST(JointAxes, EachSectionAxis_HasItsOwnYield) {
  JointLaw law = anisotropic();
  law.yield_torque = 0.1;
  law.shape.yield = {1.0, 2.0, std::numeric_limits<double>::infinity()};
  for (const FlowLaw kind : {FlowLaw::kPaper, FlowLaw::kOverstress}) {
    const Model model(joint_model(law, kind));
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d direction = kSection * Eigen::Vector3d::Unit(axis);
      State below = initial_state(model);
      apply(model, below, 0.098 * std::min(law.shape.yield[axis], 5.0) * direction, 2.0);
      EXPECT_EQ(below.bodies[0].rest_rotation.coeffs(), Eigen::Quaterniond::Identity().coeffs()) << "axis " << axis;
      State above = initial_state(model);
      apply(model, above, 0.12 * std::min(law.shape.yield[axis], 5.0) * direction, 1.0);
      if (axis == 2) {
        EXPECT_LT(rest(above).norm(), 1e-12) << "an axis that never yields";
      } else {
        EXPECT_GT(rest(above).dot(direction), 1e-3) << "axis " << axis;
      }
    }
  }
}

TEST(JointAxes, LockedAxis_DoesNotTurn) {
  JointLaw law = anisotropic();
  law.yield_torque = 0.3;
  law.shape.locked = {false, true, false};
  const Model model(joint_model(law));
  State state = initial_state(model);
  apply(model, state, kSection * Eigen::Vector3d(0.0, 5.0, 0.0), 2.0);
  EXPECT_LT((angle(state)).norm(), 6.0 / kRigidStiffness);
  EXPECT_NEAR((kSection.conjugate() * state.bodies[0].torque).y(), 5.0, 1e-6) << "it still reports what it carries";

  State other = initial_state(model);
  apply(model, other, kSection * Eigen::Vector3d(0.2, 0.0, 0.0), 5.0);
  EXPECT_LT((kSection.conjugate() * angle(other) - Eigen::Vector3d(0.2, 0.0, 0.0)).norm(), 1e-6)
      << "the other axes turn as ever";
}

TEST(JointAxes, InfiniteStiffness_IsRigidUntilYield) {
  JointLaw law{.stiffness = std::numeric_limits<double>::infinity(), .flow_damping = 0.5, .yield_torque = 1.0};
  const Model model(joint_model(law, FlowLaw::kOverstress));
  State state = initial_state(model);
  apply(model, state, {0.9, 0.0, 0.0}, 1.0);
  EXPECT_LT(angle(state).norm(), 1e-8);
  apply(model, state, {1.2, 0.0, 0.0}, 2.0);
  // The load is above t_y in the last sixth of its rise of 1 s, at 0.1 N m in the mean, then 0.2 N m for 1 s.
  EXPECT_NEAR(angle(state).x(), (0.1 / 6.0 + 0.2) / 0.5, 3e-3);
}

TEST(JointAxes, NoStiffness_HangsLoose) {
  const Model model(joint_model({.stiffness = 0.0, .damping = 0.0}));
  State state = initial_state(model);
  apply(model, state, {1e-3, 0.0, 0.0}, 1.0);
  // Rising over T/2, then constant: angle = t / I (T^2/24 + T^2/8 + T^2/8).
  EXPECT_NEAR(angle(state).x(), 7.0 / 24.0, 1e-3);
  EXPECT_LT(state.bodies[0].torque.norm(), 1e-15);
}

TEST(JointAxes, NoDamping_OscillatesAtItsFrequency) {
  const Model model(joint_model({.stiffness = 2.0, .damping = 0.0}));
  State state = initial_state(model);
  state.bodies[0].rotation = math::exp_rotation({0.2, 0.0, 0.0});
  Workspace workspace(model);
  const double period = 2.0 * M_PI * std::sqrt(1e-3 / 2.0);
  for (int k = 0; k < 400; ++k) {
    ASSERT_EQ(step(model, state, workspace, {}, {.step = period / 400, .order = 4}).status, StepStatus::kOk);
  }
  EXPECT_NEAR(angle(state).x(), 0.2, 1e-8);
}

TEST(JointAxes, Hardening_StopsTheFlowWhereItCarriesTheLoad) {
  const JointLaw law{
      .stiffness = 5.0, .damping = 0.2, .flow_damping = 0.5, .yield_torque = 0.5, .hardening = 2.0, .shape = {}};
  for (const FlowLaw kind : {FlowLaw::kPaper, FlowLaw::kOverstress}) {
    const Model model(joint_model(law, kind));
    State state = initial_state(model);
    apply(model, state, {0.9, 0.0, 0.0}, 5.0);
    // The load rises at 0.36 N m/s, so the joint flows at 0.18 rad/s when the rise ends, and its inertia carries it on
    // by at most 0.18 sqrt(I / H).
    const double overshoot = 0.18 * std::sqrt(1e-3 / 2.0);
    EXPECT_NEAR(state.bodies[0].flow, (0.9 - 0.5) / 2.0 + 0.5 * overshoot, 0.55 * overshoot);
    EXPECT_NEAR(rest(state).x(), state.bodies[0].flow, 1e-9);
  }
}

TEST(JointAxes, Softness_LetsAHeldJointFlowAndKeepIt) {
  const JointLaw law{.stiffness = 5.0, .damping = 0.2, .flow_damping = 0.05, .yield_torque = 1.0};
  const Model model(joint_model(law));
  State state = initial_state(model);
  apply(model, state, {0.5, 0.0, 0.0}, 0.5);
  EXPECT_EQ(rest(state).norm(), 0.0);
  state.bodies[0].yield_scale = 0.3;
  apply(model, state, {0.5, 0.0, 0.0}, 0.1);
  const double flowed = rest(state).x();
  EXPECT_GT(flowed, 0.02);
  state.bodies[0].yield_scale = 1.0;
  apply(model, state, {0.0, 0.0, 0.0}, 3.0);
  EXPECT_NEAR(angle(state).x(), rest(state).x(), 1e-9);
  EXPECT_GE(rest(state).x(), flowed - 1e-12);
}

}  // namespace
}  // namespace layfigure::dynamics
