#include "layfigure/haptics/local_dynamics.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "haptic_rig.h"

namespace layfigure::haptics {
namespace {

using dynamics::State;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using testing::FullRig;
using testing::Hand;
using testing::HapticRig;
using testing::HeldScene;
using testing::MultirateRig;

constexpr CouplingGains kGrab{.stiffness = 1000.0, .damping = 5.0};
constexpr double kHapticRate = 10'000.0;
// What the haptics are held to: the smallest difference in force that people notice is 7 %.
constexpr double kFelt = 0.03;

Hand still(const CouplingTarget& target) {
  return [target](double) { return target; };
}

/// Goes `way` away from a pose within `duration`, smoothly, and stays.
Hand moved(const CouplingTarget& from, const Vector3d& way, double duration) {
  return [=](double time) {
    const double s = std::clamp(time / duration, 0.0, 1.0);
    CouplingTarget target = from;
    target.position += s * s * (3.0 - 2.0 * s) * way;
    target.velocity = 6.0 * s * (1.0 - s) / duration * way;
    return target;
  };
}

MatrixXd matrix_of(const LocalModel& model, const double* numbers) {
  return Eigen::Map<const MatrixXd>(numbers, model.rows(), model.rows());
}

/// A model of the held doll's first interval.
LocalModel first_model(const HeldScene& held, double length, double tick) {
  scene::Scene scene(held.definition);
  State state = held.start;
  (void)scene.step(state, {.couplings = held.pins}, {.step = length});
  LocalModeler modeler(scene.model());
  LocalModel model;
  const TrialStep trial{
      .before = held.start, .workspace = scene.workspace(), .loads = {}, .contacts = {}, .length = length};
  EXPECT_TRUE(modeler.make(trial, held.pointers, tick, model));
  return model;
}

TEST(LocalModel, TickAsLongAsTheStep_AnswersLikeTheStep) {
  HeldScene held = testing::held_doll(2, {});
  constexpr double kLength = 5e-3;
  const LocalModel model = first_model(held, kLength, kLength);
  ASSERT_EQ(model.rows(), 12);
  scene::Scene scene(held.definition);
  State state = held.start;
  (void)scene.step(state, {}, {.step = kLength});
  dynamics::PortResponse response(scene.model());
  std::vector<dynamics::Port> ports;
  for (const PointerPort& pointer : held.pointers) ports.push_back(pointer.port);
  ASSERT_TRUE(response.measure(scene.model(), held.start, scene.workspace(), kLength, ports));
  const MatrixXd S = matrix_of(model, model.response.data());
  // The least compliance that keeps rigid ports invertible, seen against that of the doll.
  EXPECT_LE((S - response.matrix()).norm(), 1e-4 * response.matrix().norm());
}

TEST(LocalModel, MassDampingStiffness_ArePassive) {
  for (const double length : {1e-3, 2e-2}) {
    const LocalModel model = first_model(testing::held_doll(2, kGrab), length, 1e-4);
    const MatrixXd M = matrix_of(model, model.mass.data());
    const MatrixXd K = matrix_of(model, model.spring.data());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(M).eigenvalues().minCoeff(), 0.0);
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<MatrixXd>(K).eigenvalues().minCoeff(), -1e-9 * K.norm());
  }
}

TEST(LocalDynamics, BeforeTheFirstModel_NothingIsFelt) {
  LocalDynamics local;
  PortWrench felt{.force = Vector3d::Ones(), .torque = Vector3d::Ones()};
  const CouplingTarget target;
  local.tick({&target, 1}, {&felt, 1});
  EXPECT_EQ(felt.force, Vector3d::Zero());
  EXPECT_TRUE(local.end_interval().empty());
}

TEST(LocalDynamics, DollAtRestInTheHand_FeelsSteadyBetweenSlowSteps) {
  // The hand carries a part of the weight.
  const HeldScene held = testing::held_doll(1, kGrab);
  const CouplingTarget home = testing::held_pose(held, 0);
  const std::vector<Hand> hand{moved(home, {0.0, 0.0, 2e-2}, 0.5)};
  MultirateRig rig(held, 50.0, kHapticRate);
  while (rig.time() < 20.0) (void)rig.tick(hand);
  const Vector3d settled = rig.tick(hand)[0].force;
  ASSERT_GT(settled.norm(), 0.5);
  for (int k = 0; k < 1000; ++k) {
    EXPECT_LE((rig.tick(hand)[0].force - settled).norm(), 1e-3 * settled.norm()) << "no ripple";
  }
}

double held_force(double physics_hz) {
  const HeldScene held = testing::held_doll(1, kGrab);
  const std::vector<Hand> hand{moved(testing::held_pose(held, 0), {0.0, 0.0, 2e-2}, 0.5)};
  MultirateRig rig(held, physics_hz, 1000.0);
  while (rig.time() < 20.0) (void)rig.tick(hand);
  return rig.tick(hand)[0].force.norm();
}

TEST(LocalDynamics, PhysicsRate_DoesNotChangeTheFeltStiffness) {
  const double slow = held_force(50.0);
  const double fast = held_force(500.0);
  EXPECT_NEAR(slow / fast, 1.0, kFelt);
}

struct Difference {
  double worst{0.0};    ///< of the forces on all hands [N]
  double largest{0.0};  ///< force of the full model [N]
};

/// The same hands on the local dynamics and on the full model.
Difference compare(const HeldScene& held, const std::vector<Hand>& hands, double physics_hz, double duration) {
  MultirateRig local(held, physics_hz, kHapticRate);
  FullRig full(held, kHapticRate);
  Difference found;
  while (local.time() < duration) {
    const auto felt = local.tick(hands);
    const auto expected = full.tick(hands);
    for (std::size_t k = 0; k < hands.size(); ++k) {
      found.worst = std::max(found.worst, (felt[k].force - expected[k].force).norm());
      found.largest = std::max(found.largest, expected[k].force.norm());
    }
  }
  EXPECT_EQ(local.failed_steps(), 0);
  return found;
}

TEST(LocalDynamics, OneHandPushes_FeelsTheFullModel) {
  const HeldScene held = testing::held_doll(1, kGrab);
  const std::vector<Hand> hand{moved(testing::held_pose(held, 0), {0.01, 0.0, 0.02}, 0.3)};
  const Difference found = compare(held, hand, 1000.0, 0.6);
  EXPECT_GT(found.largest, 1.0);
  EXPECT_LE(found.worst, kFelt * found.largest);
}

TEST(LocalDynamics, TwoHands_EachFeelsTheOtherThroughTheDoll) {
  CouplingGains firm = kGrab;
  firm.angular_stiffness = 1.0;
  firm.angular_damping = 0.01;
  const HeldScene held = testing::held_doll(2, firm);
  const std::vector<Hand> hands{moved(testing::held_pose(held, 0), {0.0, 0.02, 0.02}, 0.3),
                                still(testing::held_pose(held, 1))};
  const Difference found = compare(held, hands, 1000.0, 0.6);
  EXPECT_LE(found.worst, kFelt * found.largest);
  // The hand that holds still is pulled.
  MultirateRig rig(held, 1000.0, kHapticRate);
  while (rig.time() < 0.6) (void)rig.tick(hands);
  EXPECT_GT(rig.tick(hands)[1].force.norm(), 0.05);
}

TEST(LocalDynamics, Touch_PushesAsTheFullModelDoes) {
  const HeldScene held = testing::touched_limb({{.stiffness = 800.0, .damping = 4.0}});
  const std::vector<Hand> hand{moved(testing::held_pose(held, 0), {0.0, 0.0, -0.012}, 0.2)};
  const Difference found = compare(held, hand, 1000.0, 0.5);
  EXPECT_GT(found.largest, 1.0) << "it has been touched";
  EXPECT_LE(found.worst, 2.0 * kFelt * found.largest) << "an impact's peak included";
}

TEST(LocalDynamics, TouchThatLeaves_DropsOutAtOnce) {
  const HeldScene held = testing::touched_limb({{.stiffness = 800.0, .damping = 4.0}});
  const CouplingTarget home = testing::held_pose(held, 0);
  const Hand pressed = moved(home, {0.0, 0.0, -0.012}, 0.2);
  const Hand left = [&](double time) {
    if (time < 0.5) return pressed(time);
    CouplingTarget target = home;
    target.position.z() += 0.01;
    return target;
  };
  const std::vector<Hand> hand{left};
  // The physics is slow: within one of its steps the contact ends.
  MultirateRig rig(held, 50.0, kHapticRate);
  while (rig.time() < 0.5) (void)rig.tick(hand);
  double pull = 0.0;
  while (rig.time() < 0.7) {
    const Vector3d felt = rig.tick(hand)[0].force;
    if (rig.time() > 0.6) pull = std::max(pull, felt.norm());
  }
  // The ball's own mass, 0.05 kg, is all that is moved, and has come to rest: nothing sticks.
  EXPECT_NEAR(rig.local().position(0).z(), home.position.z() + 0.01, 1e-3);
  EXPECT_LE(pull, 0.5);
  EXPECT_EQ(rig.local().unsolved(), 0);
}

TEST(LocalDynamics, Friction_HoldsWithinTheCone) {
  const HeldScene held = testing::touched_limb({{.stiffness = 800.0, .damping = 4.0}});
  const CouplingTarget home = testing::held_pose(held, 0);
  const double depth = -0.012;
  for (const double share : {0.6, 1.6}) {
    const Hand rub = [&](double time) {
      CouplingTarget target = moved(home, {0.0, 0.0, depth}, 0.2)(time);
      // Sideways slowly, until the pull is that share of the cone.
      target.position.y() += std::clamp(time - 0.5, 0.0, 1.0) * share * 0.5 * 0.004;
      return target;
    };
    const std::vector<Hand> hand{rub};
    MultirateRig rig(held, 500.0, kHapticRate);
    while (rig.time() < 0.5) (void)rig.tick(hand);
    const double normal = rig.tick(hand)[0].force.z();
    while (rig.time() < 2.0) (void)rig.tick(hand);
    const Vector3d felt = rig.tick(hand)[0].force;
    EXPECT_GT(normal, 1.0);
    EXPECT_LE(std::hypot(felt.x(), felt.y()), 0.5 * felt.z() * 1.02) << "within the cone";
  }
}

}  // namespace
}  // namespace layfigure::haptics
