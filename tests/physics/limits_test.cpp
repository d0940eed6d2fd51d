// Swing-twist limits: their geometry, and joints that run into them.
#include "layfigure/dynamics/limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "constrained_scene.h"
#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kDeg = M_PI / 180.0;

JointLimits asymmetric_limits() {
  return {.axes = Eigen::Quaterniond(0.9, 0.1, -0.3, 0.2).normalized(),
          .reference = Eigen::Quaterniond(0.7, -0.2, 0.5, 0.1).normalized(),
          .twist_lower = -20.0 * kDeg,
          .twist_upper = 50.0 * kDeg,
          .swing_lower = {10.0 * kDeg, 60.0 * kDeg},
          .swing_upper = {45.0 * kDeg, 30.0 * kDeg}};
}

/// R_PB with the given twist and swing.
Eigen::Quaterniond rotation_with(const JointLimits& limits, double twist, const Eigen::Vector2d& swing) {
  const Eigen::Quaterniond q = math::exp_rotation(Eigen::Vector3d(0.0, swing.x(), swing.y())) *
                               math::exp_rotation(Eigen::Vector3d(twist, 0.0, 0.0));
  return reference_axes(limits) * q * limits.axes.conjugate();
}

TEST(Limits, Rotation_IsSplitIntoSwingAndTwist) {
  const JointLimits limits = asymmetric_limits();
  for (const double twist : {-3.0, -0.4, 0.0, 1.2, 3.1}) {
    for (const Eigen::Vector2d& swing :
         {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.3, -1.1), Eigen::Vector2d(-2.0, 2.0)}) {
      const LimitState state = limit_state(limits, rotation_with(limits, twist, swing));
      EXPECT_NEAR(state.twist, twist, 1e-14);
      EXPECT_LE((state.swing_y_z - swing).norm(), 1e-14);
    }
  }
}

TEST(Limits, Gaps_AreThoseOfTheQuarterEllipses) {
  const JointLimits limits = asymmetric_limits();
  EXPECT_NEAR(limit_state(limits, rotation_with(limits, 0.1, {0.0, 0.0})).lower_twist.gap, 0.1 + 20.0 * kDeg, 1e-14);
  EXPECT_NEAR(limit_state(limits, rotation_with(limits, 0.1, {0.0, 0.0})).upper_twist.gap, 50.0 * kDeg - 0.1, 1e-14);
  const auto gap = [&](double y, double z) {
    return limit_state(limits, rotation_with(limits, 0.3, {y, z})).swing.gap;
  };
  EXPECT_NEAR(gap(40.0 * kDeg, 0.0), 5.0 * kDeg, 1e-13);
  EXPECT_NEAR(gap(-12.0 * kDeg, 0.0), -2.0 * kDeg, 1e-13);
  EXPECT_NEAR(gap(0.0, 25.0 * kDeg), 5.0 * kDeg, 1e-13);
  EXPECT_NEAR(gap(0.0, -59.0 * kDeg), 1.0 * kDeg, 1e-13);
  // On the ellipse between the axes.
  EXPECT_NEAR(gap(45.0 * kDeg * std::cos(0.7), 30.0 * kDeg * std::sin(0.7)), 0.0, 1e-13);
  EXPECT_NEAR(gap(45.0 * kDeg * std::cos(0.7), -60.0 * kDeg * std::sin(0.7)), 0.0, 1e-13);
}

TEST(Limits, Directions_AreTheGapsDerivatives) {
  const JointLimits limits = asymmetric_limits();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const double step = 1e-6;
  for (int k = 0; k < 100; ++k) {
    const Eigen::Quaterniond rotation =
        rotation_with(limits, 2.0 * uniform(random), {1.2 * uniform(random), 1.2 * uniform(random)});
    const Eigen::Vector3d w(uniform(random), uniform(random), uniform(random));  // axes of the reference
    const Eigen::Quaterniond R_PR = reference_axes(limits);
    const auto moved = [&](double s) {
      return limit_state(limits, math::exp_rotation(R_PR * Eigen::Vector3d(s * w)) * rotation);
    };
    const LimitState here = limit_state(limits, rotation);
    const LimitState ahead = moved(step);
    const LimitState behind = moved(-step);
    EXPECT_NEAR((ahead.lower_twist.gap - behind.lower_twist.gap) / (2.0 * step), here.lower_twist.direction.dot(w),
                1e-8);
    EXPECT_NEAR((ahead.upper_twist.gap - behind.upper_twist.gap) / (2.0 * step), here.upper_twist.direction.dot(w),
                1e-8);
    // The swing's gap is (1 - F) / |grad F|; its direction is that of F alone, exact at the bound.
    const double on_bound = std::abs(here.swing.gap);
    EXPECT_NEAR((ahead.swing.gap - behind.swing.gap) / (2.0 * step), here.swing.direction.dot(w),
                1e-7 + 20.0 * on_bound);
  }
}

TEST(Limits, Slack_IsNoMoreThanAnyTurnToALimit) {
  const JointLimits limits = asymmetric_limits();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int inside = 0;
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Quaterniond rotation =
        rotation_with(limits, 0.6 * uniform(random), {0.6 * uniform(random), 0.6 * uniform(random)});
    const LimitState here = limit_state(limits, rotation);
    if (here.slack <= 0.0) continue;
    ++inside;
    const Eigen::Vector3d turn =
        here.slack * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)).normalized();
    const LimitState there = limit_state(limits, math::exp_rotation(turn) * rotation);
    EXPECT_GE(there.lower_twist.gap, -1e-12);
    EXPECT_GE(there.upper_twist.gap, -1e-12);
    EXPECT_GE(there.swing.gap, -1e-12);
  }
  EXPECT_GT(inside, 500);
}

/// A limb that a torque drives about an axis of its limits' reference.
class Torque : public Loads {
 public:
  explicit Torque(Eigen::Vector3d torque) : torque_(std::move(torque)) {}
  void add(double, std::span<BodyForce> forces) const override { forces[0].torque += torque_; }

 private:
  Eigen::Vector3d torque_;
};

TEST(Limits, DrivenJoint_StopsAtEachBoundAndComesBack) {
  ModelDefinition definition;
  definition.gravity.setZero();
  BodyDefinition& body = definition.bodies.emplace_back();
  body.name = "limb";
  body.mass = 1.0;
  body.inertia = 0.01 * Eigen::Matrix3d::Identity();  // a torque turns it about its own axis
  body.joint.damping = 0.05;
  body.limits = asymmetric_limits();
  body.rotation = body.rest_rotation = rotation_with(body.limits, 0.0, {0.0, 0.0});
  const Model model(definition);
  const Eigen::Quaterniond R_WR = reference_axes(body.limits);
  const double lower_y = 10.0 * kDeg, upper_y = 45.0 * kDeg, lower_z = 60.0 * kDeg, upper_z = 30.0 * kDeg;
  const std::pair<Eigen::Vector3d, Eigen::Vector3d> cases[] = {
      {{0.3, 0.0, 0.0}, {50.0 * kDeg, 0.0, 0.0}}, {{-0.3, 0.0, 0.0}, {-20.0 * kDeg, 0.0, 0.0}},
      {{0.0, 0.3, 0.0}, {0.0, upper_y, 0.0}},     {{0.0, -0.3, 0.0}, {0.0, -lower_y, 0.0}},
      {{0.0, 0.0, 0.3}, {0.0, 0.0, upper_z}},     {{0.0, 0.0, -0.3}, {0.0, 0.0, -lower_z}}};
  for (const auto& [torque, expected] : cases) {
    State state = initial_state(model);
    Workspace workspace(model);
    const Torque drive(R_WR * torque);
    double beyond = 0.0;
    for (int n = 0; n < 4000; ++n) {
      const auto report = step(model, state, workspace, {.loads = &drive}, {.step = 1e-3});
      ASSERT_EQ(report.constraints.unsolved, 0);
      const LimitState now = limit_state(body.limits, state.bodies[0].rotation);
      beyond = std::min({beyond, now.lower_twist.gap, now.upper_twist.gap, now.swing.gap});
    }
    const LimitState end = limit_state(body.limits, state.bodies[0].rotation);
    const Eigen::Vector3d reached(end.twist, end.swing_y_z.x(), end.swing_y_z.y());
    EXPECT_LE((reached - expected).norm(), 2e-3)
        << reached.transpose() / kDeg << " instead of " << expected.transpose() / kDeg;
    EXPECT_GE(beyond, -1e-3);
    const Torque back(R_WR * Eigen::Vector3d(-torque));
    for (int n = 0; n < 50; ++n) (void)step(model, state, workspace, {.loads = &back}, {.step = 1e-3});
    const LimitState after = limit_state(body.limits, state.bodies[0].rotation);
    EXPECT_GT(std::min({after.lower_twist.gap, after.upper_twist.gap, after.swing.gap}), 1e-3) << "it must not stick";
  }
}

TEST(Limits, JointFarFromItsLimits_CostsNoRowsAndMovesAsWithout) {
  ModelDefinition definition = bent_tree(RootKind::kBall, std::numeric_limits<double>::infinity());
  const Model free_model(definition);
  for (BodyDefinition& body : definition.bodies) {
    body.limits.reference = body.rotation;
    body.limits.twist_lower = -1.5;
    body.limits.twist_upper = 1.5;
    body.limits.swing_lower = body.limits.swing_upper = {1.5, 1.5};
  }
  const Model model(definition);
  State state = initial_state(model);
  State free_state = initial_state(free_model);
  Workspace workspace(model);
  Workspace free_workspace(free_model);
  for (int n = 0; n < 100; ++n) {
    EXPECT_EQ(step(model, state, workspace, {}, {.step = 1e-3}).constraints.rows, 0);
    (void)step(free_model, free_state, free_workspace, {}, {.step = 1e-3});
  }
  for (int i = 0; i < model.size(); ++i) {
    EXPECT_EQ(state.bodies[i].rotation.coeffs(), free_state.bodies[i].rotation.coeffs());
    EXPECT_EQ(state.bodies[i].linear_momentum, free_state.bodies[i].linear_momentum);
  }
}

}  // namespace
}  // namespace layfigure::testing
