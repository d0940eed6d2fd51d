#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "layfigure/scene/scene.h"

namespace layfigure::scene {
namespace {

constexpr double kMass = 1.0;
constexpr double kGravity = 9.81;
constexpr double kRadius = 0.05;
constexpr double kPad = 0.01;
constexpr double kMu = 0.5;
constexpr double kH = 1e-3;

/// A ball on the floor, at rest in the beginning, that touches it with a pad.
SceneDefinition ball_on_floor(double pad, double depth = 0.0) {
  SceneDefinition definition;
  dynamics::BodyDefinition ball;
  ball.name = "ball";
  ball.mass = kMass;
  ball.anchor = {0, 0, kRadius};
  ball.inertia = 0.4 * kMass * kRadius * kRadius * Eigen::Matrix3d::Identity();
  definition.model.bodies.push_back(ball);
  definition.model.root = dynamics::RootKind::kFree;
  definition.shapes.resize(2);
  definition.shapes[0].shape = collision::Sphere{kRadius};
  definition.shapes[0].body = 0;
  definition.shapes[0].friction = kMu;
  definition.shapes[1].shape = collision::Plane{};
  definition.shapes[1].friction = kMu;
  if (pad > 0.0) definition.pads.push_back({.body = 0, .radius = pad, .depth = depth});
  return definition;
}

class Push : public dynamics::Loads {
 public:
  explicit Push(const dynamics::BodyForce& push) : push_(push) {}
  void add(double, std::span<dynamics::BodyForce> forces) const override {
    forces[0].force += push_.force;
    forces[0].torque += push_.torque;
  }

 private:
  dynamics::BodyForce push_;
};

/// Momenta after half a second under a push.
dynamics::BodyState pushed(double pad, const dynamics::BodyForce& push) {
  Scene scene(ball_on_floor(pad));
  dynamics::State state = dynamics::initial_state(scene.model());
  const Push loads(push);
  for (int k = 0; k < 500; ++k) {
    const SceneReport report = scene.step(state, {.loads = &loads}, {.step = kH});
    EXPECT_EQ(report.step.status, dynamics::StepStatus::kOk);
  }
  return state.bodies[0];
}

TEST(Pad, SpunBelowItsLimit_StandsStill) {
  const double limit = kMu * kMass * kGravity * kPad;
  const double spin = pushed(kPad, {.torque = {0, 0, 0.98 * limit}}).angular_momentum.z();
  EXPECT_LT(std::abs(spin), 1e-9);
}

TEST(Pad, SpunBeyondItsLimit_TurnsWithTheRest) {
  const double limit = kMu * kMass * kGravity * kPad;
  const double spin = pushed(kPad, {.torque = {0, 0, 1.5 * limit}}).angular_momentum.z();
  EXPECT_NEAR(spin, 0.5 * 0.5 * limit, 0.01 * 0.25 * limit);
}

TEST(Pad, WithoutOne_NothingResistsSpin) {
  const double torque = 1e-3;
  EXPECT_NEAR(pushed(0.0, {.torque = {0, 0, torque}}).angular_momentum.z(), 0.5 * torque, 1e-6 * torque);
}

TEST(Pad, TiltedBelowItsEdge_DoesNotRoll) {
  const double edge = 0.5 * kMass * kGravity * kPad;  // the triangle's nearest side
  EXPECT_LT(pushed(kPad, {.torque = {0.9 * edge, 0, 0}}).angular_momentum.norm(), 1e-9);
  EXPECT_GT(pushed(0.0, {.torque = {0.9 * edge, 0, 0}}).angular_momentum.norm(), 1e-3);
}

/// Where a ball's middle is after so long under a torque beyond what its pad bears, and how far it has turned.
dynamics::BodyState tilted(double depth) {
  Scene scene(ball_on_floor(kPad, depth));
  dynamics::State state = dynamics::initial_state(scene.model());
  const double edge = kMass * kGravity * kPad;
  const Push loads({.torque = {1.2 * edge, 0, 0}});
  for (int k = 0; k < 200; ++k) (void)scene.step(state, {.loads = &loads}, {.step = kH});
  return state.bodies[0];
}

TEST(Pad, TiltedBeyondItsEdge_RollsOnTheSurfaceOrTurnsAboutItsMiddle) {
  const dynamics::BodyState rolled = tilted(0.0);
  EXPECT_GT(rolled.rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.1);
  EXPECT_LT(rolled.position.y(), -0.1 * kRadius);
  const dynamics::BodyState turned = tilted(kRadius);
  EXPECT_GT(turned.rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.1);
  EXPECT_LT(turned.position.head<2>().norm(), 1e-9);
}

TEST(Pad, AtAnyDepth_MomentumIsPassedOnWhole) {
  // Two balls that rub on each other in space, the pad on either.
  for (const int body : {0, 1}) {
    SceneDefinition definition = ball_on_floor(0.0);
    definition.shapes.resize(1);
    definition.model.gravity.setZero();
    dynamics::BodyDefinition other = definition.model.bodies[0];
    other.name = "other";
    other.anchor = {0, 0, 3.0 * kRadius + 1e-4};
    definition.model.bodies.push_back(other);
    definition.shapes.push_back(definition.shapes[0]);
    definition.shapes.back().body = 1;
    definition.pads.push_back({.body = body, .radius = kPad, .depth = kRadius});
    Scene scene(definition);
    dynamics::State state = dynamics::initial_state(scene.model());
    state.bodies[1].linear_momentum = {0.02, 0.1, -0.5};
    state.bodies[1].angular_momentum = {1e-3, -2e-3, 5e-4};
    const auto momentum = [&state] {
      Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
      for (const dynamics::BodyState& ball : state.bodies) {
        sum.head<3>() += ball.linear_momentum;
        sum.tail<3>() += ball.angular_momentum + ball.position.cross(ball.linear_momentum);
      }
      return sum;
    };
    const Eigen::Matrix<double, 6, 1> before = momentum();
    bool touched = false;
    for (int k = 0; k < 50; ++k) {
      (void)scene.step(state, {}, {.step = 1e-4});
      touched = touched || (!scene.contacts().empty() && !scene.contact_force(0).isZero(0.0));
    }
    EXPECT_TRUE(touched);
    EXPECT_LT((momentum() - before).head<3>().norm(), 1e-12);
    EXPECT_LT((momentum() - before).tail<3>().norm(), 1e-6);  // a step turns levers that it takes as they were
  }
}

TEST(Pad, ForceOfAContact_IsThatOfItsWholePad) {
  Scene scene(ball_on_floor(kPad));
  dynamics::State state = dynamics::initial_state(scene.model());
  for (int k = 0; k < 100; ++k) (void)scene.step(state, {}, {.step = kH});
  ASSERT_EQ(scene.contacts().size(), 1U);
  EXPECT_NEAR(scene.contact_force(0).z(), kMass * kGravity, 1e-6);
}

TEST(Pad, ThatCannotBe_Refused) {
  SceneDefinition definition = ball_on_floor(0.0);
  definition.pads.push_back({.body = 1, .radius = 0.01});
  EXPECT_THROW(Scene{definition}, std::invalid_argument);
  definition.pads[0] = {.body = 0, .radius = -0.01};
  EXPECT_THROW(Scene{definition}, std::invalid_argument);
  definition.pads[0].radius = std::nan("");
  EXPECT_THROW(Scene{definition}, std::invalid_argument);
  definition.pads[0] = {.body = 0, .radius = 0.01, .depth = -0.01};
  EXPECT_THROW(Scene{definition}, std::invalid_argument);
}

TEST(LetThrough, PairOfBodies_DoesNotTouch) {
  SceneDefinition definition = ball_on_floor(0.0);
  dynamics::BodyDefinition upper = definition.model.bodies[0];
  upper.name = "upper";
  upper.anchor.z() = 3.0 * kRadius;
  definition.model.bodies.push_back(upper);
  definition.shapes.push_back(definition.shapes[0]);
  definition.shapes.back().body = 1;
  Scene scene(definition);
  dynamics::State state = dynamics::initial_state(scene.model());
  for (int k = 0; k < 100; ++k) (void)scene.step(state, {}, {.step = kH});
  EXPECT_NEAR(state.bodies[1].position.z(), 3.0 * kRadius, 1e-6);
  const std::pair<int, int> pair{1, 0};
  scene.let_through({&pair, 1});
  for (int k = 0; k < 300; ++k) (void)scene.step(state, {}, {.step = kH});
  EXPECT_NEAR(state.bodies[1].position.z(), kRadius, 1e-6);
}

TEST(DepthOf, Body_IsHowDeepItLies) {
  Scene scene(ball_on_floor(0.0));
  dynamics::State state = dynamics::initial_state(scene.model());
  EXPECT_NEAR(scene.depth_of(state, 0), 0.0, 1e-12);
  state.bodies[0].position.z() -= 0.02;
  EXPECT_NEAR(scene.depth_of(state, 0), 0.02, 1e-12);
  state.bodies[0].position.z() += 1.0;
  EXPECT_EQ(scene.depth_of(state, 0), 0.0);
}

}  // namespace
}  // namespace layfigure::scene
