// Drives on one joint: closed forms, saturation, limits, yield.
#include <gtest/gtest.h>

#include <cmath>

#include "layfigure/dynamics/limits.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kInertia = 0.02;
constexpr double kG = 9.81;
// What some hundred steps' rounding leaves of quantities of about one.
constexpr double kRounding = 1e-12;
const Eigen::Vector3d kAxis = Eigen::Vector3d(2.0, -1.0, 2.0) / 3.0;

/// A ball on a joint without a law: what turns it is known.
ModelDefinition ball() {
  ModelDefinition definition;
  definition.gravity.setZero();
  definition.bodies.resize(1);
  definition.bodies[0].inertia = kInertia * Eigen::Matrix3d::Identity();
  return definition;
}

/// A weight at the end of a horizontal arm.
ModelDefinition arm(double mass, double length) {
  ModelDefinition definition;
  definition.bodies.resize(1);
  definition.bodies[0].mass = mass;
  definition.bodies[0].com = {length, 0.0, 0.0};
  definition.bodies[0].inertia = 1e-3 * Eigen::Matrix3d::Identity();
  return definition;
}

double angle_of(const State& state) { return math::log_rotation(state.bodies[0].rotation).dot(kAxis); }
double rate_of(const State& state) { return state.bodies[0].angular_momentum.dot(kAxis) / kInertia; }

StepReport drive_step(const Model& model, State& state, Workspace& workspace, const Drive& drive, double h) {
  const StepReport report = step(model, state, workspace, {.drives = {&drive, 1}}, {.step = h});
  EXPECT_EQ(report.status, StepStatus::kOk);
  EXPECT_TRUE(report.converged);
  return report;
}

TEST(Drive, FreeJoint_ReachesItsTargetAtTheImplicitRate) {
  const Model model(ball());
  const double K = 4.0, B = 0.3, h = 0.01, target = 1.2;
  Drive drive{.stiffness = K, .damping = B};
  drive.target_rotation = math::exp_rotation(target * kAxis);
  State state = initial_state(model);
  Workspace workspace(model);
  double angle = 0.0, rate = 0.0;
  for (int n = 0; n < 300; ++n) {
    const StepReport report = drive_step(model, state, workspace, drive, h);
    EXPECT_EQ(report.solves, 1) << "an unbounded drive is linear";
    EXPECT_EQ(report.constraints.rows, 0);
    rate = (kInertia * rate + h * K * (target - angle)) / (kInertia + h * (h * K + B));
    angle += h * rate;
    ASSERT_NEAR(angle_of(state), angle, kRounding);
    ASSERT_NEAR(workspace.drive_torque(0).dot(kAxis), K * (target - angle) - B * rate, 1e-9);
  }
  EXPECT_NEAR(angle, target, 1e-6);
}

TEST(Drive, MovingTarget_IsFollowedWithoutLag) {
  const Model model(ball());
  Drive drive{.stiffness = 50.0, .damping = 2.0};
  drive.target_velocity = 0.7 * kAxis;
  const double h = 1e-3;
  State state = initial_state(model);
  Workspace workspace(model);
  for (int n = 0; n < 4000; ++n) {
    drive.target_rotation = math::exp_rotation(n * h * drive.target_velocity);
    (void)drive_step(model, state, workspace, drive, h);
  }
  EXPECT_NEAR(angle_of(state), 4000 * h * 0.7, 1e-9);
  EXPECT_NEAR(rate_of(state), 0.7, 1e-9);
}

TEST(Drive, VelocityAlone_IsAMotor) {
  const Model model(ball());
  Drive drive{.damping = 0.5, .max_torque = 0.04};
  drive.target_velocity = 3.0 * kAxis;
  State state = initial_state(model);
  Workspace workspace(model);
  for (int n = 0; n < 1000; ++n) {
    (void)drive_step(model, state, workspace, drive, 1e-3);
    // At its largest torque until the speed is near.
    ASSERT_GE(rate_of(state), std::min(0.04 / kInertia * (n + 1) * 1e-3, 2.9) - kRounding);
  }
  for (int n = 0; n < 2000; ++n) (void)drive_step(model, state, workspace, drive, 1e-3);
  EXPECT_NEAR(rate_of(state), 3.0, 1e-9);
}

TEST(Drive, BeyondItsLargestTorque_ExertsExactlyThat) {
  const Model model(ball());
  Drive drive{.stiffness = 400.0, .damping = 100.0, .max_torque = 0.25};
  drive.target_rotation = math::exp_rotation(2.0 * kAxis);
  const double h = 1e-3;
  State state = initial_state(model);
  Workspace workspace(model);
  for (int n = 1; n <= 100; ++n) {
    EXPECT_EQ(drive_step(model, state, workspace, drive, h).solves, 1) << "its regime is foreseen";
    EXPECT_LE((workspace.drive_torque(0) - 0.25 * kAxis).norm(), kRounding);
    EXPECT_NEAR(rate_of(state), 0.25 * n * h / kInertia, kRounding);
  }
  // All the way there, braking with no more than that.
  for (int n = 0; n < 10000; ++n) {
    (void)drive_step(model, state, workspace, drive, h);
    ASSERT_LE(workspace.drive_torque(0).norm(), 0.25 * (1.0 + kRounding));
  }
  EXPECT_NEAR(angle_of(state), 2.0, 1e-6);
}

TEST(Drive, LoadHeavierThanItsLimit_MakesItGiveWay) {
  const double mass = 2.0, length = 0.3, h = 1e-3;
  const double weight = mass * kG * length;
  const Model model(arm(mass, length));
  const double inertia = mass * length * length + 1e-3;
  for (const double stiffness : {1e4, Drive::kInfinity}) {
    const Drive weak{.stiffness = stiffness, .damping = 1.0, .max_torque = 0.9 * weight};
    State state = initial_state(model);
    Workspace workspace(model);
    (void)drive_step(model, state, workspace, weak, h);
    if (stiffness == Drive::kInfinity) {
      const double momentum = state.bodies[0].linear_momentum.norm() / mass / length * inertia;
      EXPECT_NEAR(momentum, h * 0.1 * weight, 1e-9) << "only what it cannot hold moves the arm";
    }
    for (int n = 0; n < 800; ++n) (void)drive_step(model, state, workspace, weak, h);
    EXPECT_LT((state.bodies[0].rotation * model.body(0).com).z(), -0.5 * length);
    const Drive strong{.stiffness = stiffness, .damping = 1.0, .max_torque = 1.1 * weight};
    state = initial_state(model);
    for (int n = 0; n < 800; ++n) (void)drive_step(model, state, workspace, strong, h);
    EXPECT_NEAR(workspace.drive_torque(0).norm(), weight, 1e-3 * weight);
    const double sag = math::log_rotation(state.bodies[0].rotation).norm();
    EXPECT_NEAR(sag, weight / std::min(stiffness, kRigidStiffness), 1e-3 * weight / stiffness + 1e-7);
  }
}

TEST(Drive, BeyondTheJointsLimit_StopsThere) {
  ModelDefinition definition = ball();
  definition.bodies[0].limits.twist_lower = -0.2;
  definition.bodies[0].limits.twist_upper = 0.5;
  const Model model(definition);
  for (const double target : {-1.0, 1.0}) {
    Drive drive{.stiffness = 20.0, .damping = 0.5, .max_torque = 3.0};
    drive.target_rotation = math::exp_rotation(Eigen::Vector3d(target, 0.0, 0.0));
    State state = initial_state(model);
    Workspace workspace(model);
    for (int n = 0; n < 2000; ++n) {
      const StepReport report = drive_step(model, state, workspace, drive, 2e-3);
      ASSERT_EQ(report.constraints.unsolved, 0);
      ASSERT_GE(math::log_rotation(state.bodies[0].rotation).x(), -0.2 - 1e-9);
      ASSERT_LE(math::log_rotation(state.bodies[0].rotation).x(), 0.5 + 1e-9);
    }
    EXPECT_NEAR(math::log_rotation(state.bodies[0].rotation).x(), target < 0.0 ? -0.2 : 0.5, 1e-9);
    EXPECT_NEAR(workspace.drive_torque(0).norm(), 3.0, kRounding) << "it presses on";
  }
}

TEST(Drive, LetGo_LeavesWhatYieldedAndSpringsBackFromTheRest) {
  ModelDefinition definition = ball();
  definition.bodies[0].joint = {.stiffness = 2.0, .damping = 0.1, .yield_torque = 0.5};
  for (const FlowLaw law : {FlowLaw::kPaper, FlowLaw::kOverstress}) {
    definition.law = law;
    const Model model(definition);
    // Perfectly plastic: the spring keeps at most t_y / K of the turn.
    for (const double target : {0.2, 1.0}) {
      Drive drive{.stiffness = 1e6, .damping = 10.0};
      State state = initial_state(model);
      Workspace workspace(model);
      for (int n = 0; n < 1500; ++n) {
        // So slowly that the joint's damper adds little.
        drive.target_rotation = math::exp_rotation(std::min(1e-3 * n, target) * kAxis);
        (void)drive_step(model, state, workspace, drive, 2e-3);
      }
      EXPECT_NEAR(angle_of(state), target, 1e-5);
      // The drive lagged by B w / K, 5e-6 rad, until its target stopped.
      EXPECT_NEAR(workspace.drive_torque(0).dot(kAxis), std::min(2.0 * target, 0.5), 2e-5);
      for (int n = 0; n < 5000; ++n) (void)step(model, state, workspace, {}, {.step = 2e-3});
      EXPECT_NEAR(angle_of(state), std::max(0.0, target - 0.5 / 2.0), 1e-5);
    }
  }
}

TEST(Drive, NotANumber_IsReportedAndLeavesTheState) {
  const Model model(ball());
  const State start = initial_state(model);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::array<Drive, 4> drives;
  drives.fill({.stiffness = 1.0, .damping = 0.1, .target_rotation = math::exp_rotation(kAxis)});
  drives[0].stiffness = kNan;
  drives[1].max_torque = kNan;
  drives[2].target_rotation.x() = kNan;
  drives[3].target_velocity.y() = kNan;
  for (const Drive& drive : drives) {
    for (const int order : {1, 3}) {
      State state = start;
      Workspace workspace(model);
      const StepReport report = step(model, state, workspace, {.drives = {&drive, 1}}, {.step = 1e-3, .order = order});
      EXPECT_EQ(report.status, StepStatus::kNotFinite) << &drive - drives.data();
      EXPECT_EQ(state.bodies[0].rotation.coeffs(), start.bodies[0].rotation.coeffs());
      EXPECT_EQ(state.time, 0.0);
    }
  }
}

TEST(Drive, OnARootWithoutAJoint_DoesNothing) {
  for (const RootKind root : {RootKind::kFree, RootKind::kFixed}) {
    ModelDefinition definition = ball();
    definition.root = root;
    const Model model(definition);
    Drive drive{.stiffness = 10.0, .damping = 1.0};
    drive.target_rotation = math::exp_rotation(kAxis);
    State state = initial_state(model);
    Workspace workspace(model);
    for (int n = 0; n < 10; ++n) (void)drive_step(model, state, workspace, drive, 1e-2);
    EXPECT_EQ(workspace.drive_torque(0).norm(), 0.0);
    EXPECT_EQ(angle_of(state), 0.0);
  }
}

}  // namespace
}  // namespace layfigure::testing
