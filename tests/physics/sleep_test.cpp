// Sleep: what is at rest costs nothing and is missed by nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "layfigure/dynamics/advance.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/math/rotation.h"
#include "ledger_check.h"
#include "scene.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kH = 1e-3;
// The joints between a fingertip and the root are each off by up to the sleep angle: together by that times the sum of
// their distances from it, 5 m in this doll.
constexpr double kPoseTolerance = 5.0 * kSleepAngle;
constexpr int kLeftHand = 9;
constexpr int kLeftFingers = 10;  // the first of 15
constexpr int kRightLeg = 48;     // the first of 4

ModelDefinition doll_52() {
  ModelDefinition definition = load_scene(std::string(LAYFIGURE_TEST_DATA) + "/scenes/doll-52.json").definition;
  for (BodyDefinition& body : definition.bodies) {
    body.joint.yield_torque = 2.0 * body.joint.stiffness * 0.3;
    body.joint.flow_damping = body.joint.damping;
  }
  return definition;
}

/// Steps until something sleeps, or for `seconds`.
StepReport advance_for(const Model& model, State& state, Workspace& workspace, double seconds,
                       const Inputs& inputs = {}, double sleep_angle = kSleepAngle) {
  StepReport report;
  for (int n = 0; n * kH < seconds; ++n) {
    report = step(model, state, workspace, inputs, {.step = kH, .sleep_angle = sleep_angle});
    EXPECT_EQ(report.status, StepStatus::kOk);
  }
  return report;
}

/// The doll, hanging from its pelvis as it does at rest.
State settled(const Model& model) {
  State state = initial_state(model);
  Workspace workspace(model);
  advance_for(model, state, workspace, 40.0, {}, 0.0);
  return state;
}

Coupling grip(const Model& model, const State& state, int body) {
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  Coupling coupling{.body = body, .point = model.body(body).com, .stiffness = 2000.0, .damping = 100.0};
  coupling.target_position = poses[body].com;
  return coupling;
}

double largest_distance(const Model& model, const State& a, const State& b) {
  std::vector<BodyPose> p, q;
  world_poses(model, a, p);
  world_poses(model, b, q);
  double most = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) most = std::max(most, (p[i].com - q[i].com).norm());
  return most;
}

Eigen::Vector3d total_momentum(const State& state) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const BodyState& body : state.bodies) sum += body.linear_momentum;
  return sum;
}

TEST(Sleep, DollAtRest_RestsAsAWholeAndStaysBitForBit) {
  const Model model(doll_52());
  State state = settled(model);
  Workspace workspace(model);
  ASSERT_TRUE(advance_for(model, state, workspace, 2.0).resting);
  const State resting = state;
  const StepReport report = advance_for(model, state, workspace, 1.0);
  EXPECT_TRUE(report.resting);
  EXPECT_EQ(report.solves, 0);
  EXPECT_NEAR(state.time, resting.time + 1.0, 1e-9);
  for (std::size_t i = 0; i < state.bodies.size(); ++i) {
    EXPECT_EQ(state.bodies[i].rotation.coeffs(), resting.bodies[i].rotation.coeffs());
    EXPECT_TRUE(state.bodies[i].linear_momentum.isZero(0.0));
  }
}

/// Sets the doll swinging, from rest, in a way that lets nothing sleep, and lets go of it.
using Disturbance = std::function<void(const Model&, State&, Workspace&, const Inputs&)>;

void expect_swings_on_after(const Disturbance& disturb) {
  const Model model(doll_52());
  State state = settled(model);
  Workspace workspace(model);
  ASSERT_TRUE(advance_for(model, state, workspace, 2.0).resting);
  Coupling pull = grip(model, state, kLeftHand);
  pull.target_position.x() += 0.05;
  disturb(model, state, workspace, {.couplings = {&pull, 1}});
  const State let_go = state;
  const StepReport report = step(model, state, workspace, {}, {.step = kH, .sleep_angle = kSleepAngle});
  ASSERT_EQ(report.status, StepStatus::kOk);
  EXPECT_FALSE(report.resting) << "the inputs are those of the rest again, the doll is not";
  EXPECT_GT(largest_distance(model, state, let_go), 0.0);
}

TEST(Sleep, DollMovedByStepsThatLetNothingSleep_RestsNoMore) {
  expect_swings_on_after([](const Model& model, State& state, Workspace& workspace, const Inputs& inputs) {
    advance_for(model, state, workspace, 0.1, inputs, 0.0);
  });
}

TEST(Sleep, DollMovedByAdvance_RestsNoMore) {
  expect_swings_on_after([](const Model& model, State& state, Workspace& workspace, const Inputs& inputs) {
    StepSize size;
    ASSERT_EQ(advance(model, state, workspace, inputs, 0.1, {.tolerance = 1e-4}, size).status, StepStatus::kOk);
  });
}

TEST(Sleep, DollAtRest_IsWhereItWouldBeWithoutSleep) {
  const Model model(doll_52());
  State asleep = settled(model);
  State awake = asleep;
  Workspace a(model), b(model);
  ASSERT_TRUE(advance_for(model, asleep, a, 20.0).resting);
  advance_for(model, awake, b, 20.0, {}, 0.0);
  EXPECT_LE(largest_distance(model, asleep, awake), kPoseTolerance);
}

/// A hand that moves up over a second and comes back.
Coupling moved(const Coupling& start, double time) {
  Coupling coupling = start;
  const double phase = 2.0 * M_PI * std::min(time, 1.0);
  coupling.target_position.z() += 0.05 * (1.0 - std::cos(phase));
  coupling.target_velocity.z() = time < 1.0 ? 0.05 * 2.0 * M_PI * std::sin(phase) : 0.0;
  return coupling;
}

TEST(Sleep, HandPosed_LegsSleepAndThePoseIsTheSame) {
  ModelDefinition definition = doll_52();
  definition.root = RootKind::kFixed;
  const Model model(definition);
  State asleep = settled(model);
  State awake = asleep;
  Workspace a(model), b(model);
  ASSERT_TRUE(advance_for(model, asleep, a, 2.0).resting);
  const Coupling start = grip(model, asleep, kLeftHand);
  double most = 0.0;
  double slept = 0.0;
  for (int n = 0; n < 2000; ++n) {
    const Coupling now = moved(start, n * kH);
    const Inputs inputs{.couplings = {&now, 1}};
    const StepReport report = step(model, asleep, a, inputs, {.step = kH, .sleep_angle = kSleepAngle});
    ASSERT_EQ(report.status, StepStatus::kOk);
    ASSERT_EQ(step(model, awake, b, inputs, {.step = kH}).status, StepStatus::kOk);
    most = std::max(most, largest_distance(model, asleep, awake));
    slept += report.asleep / 2000.0;
  }
  EXPECT_LE(most, kPoseTolerance);
  EXPECT_GE(slept, 8) << "the legs at least, on average";
}

TEST(Sleep, FingertipPosed_TheBodySleepsBehindThePull) {
  const Model model(doll_52());
  State asleep = settled(model);
  State awake = asleep;
  Workspace a(model), b(model);
  ASSERT_TRUE(advance_for(model, asleep, a, 2.0).resting);
  Coupling start = grip(model, asleep, kLeftFingers + 2);
  start.stiffness = 5.0;
  start.damping = 0.2;
  double most = 0.0;
  int least_asleep = model.size();
  for (int n = 0; n < 1000; ++n) {
    Coupling now = start;
    now.target_position.z() += 0.003 * std::sin(6.0 * n * kH);
    now.target_velocity.z() = 0.018 * std::cos(6.0 * n * kH);
    const Inputs inputs{.couplings = {&now, 1}};
    const StepReport report = step(model, asleep, a, inputs, {.step = kH, .sleep_angle = kSleepAngle});
    ASSERT_EQ(report.status, StepStatus::kOk);
    ASSERT_EQ(step(model, awake, b, inputs, {.step = kH}).status, StepStatus::kOk);
    most = std::max(most, largest_distance(model, asleep, awake));
    if (n > 100) least_asleep = std::min(least_asleep, report.asleep);
  }
  EXPECT_LE(most, kPoseTolerance);
  EXPECT_GE(least_asleep, 40) << "what is between the hand and the root too";
  EXPECT_FALSE(asleep.bodies[kLeftFingers].asleep);
  EXPECT_GT(largest_distance(model, asleep, settled(model)), 1e-4);
}

TEST(Sleep, FallingAsleepAndWaking_KeepMomentaAndNeverAddEnergy) {
  ModelDefinition definition = doll_52();
  definition.root = RootKind::kFree;
  definition.gravity.setZero();
  const Model model(definition);
  State state = initial_state(model);
  for (BodyState& body : state.bodies) body.rest_rotation = body.rotation;
  state.bodies[0].linear_momentum = {1.0, 2.0, 3.0};
  state.bodies[0].angular_momentum = {0.1, 0.2, -0.1};
  Workspace workspace(model);
  const Eigen::Vector3d start = total_momentum(state);
  int slept = 0;
  for (int n = 0; n < 20000; ++n) {
    const Energy before = energy(model, state);
    const StepReport report = step(model, state, workspace, {}, {.step = kH, .sleep_angle = kSleepAngle});
    ASSERT_EQ(report.status, StepStatus::kOk);
    ASSERT_LE(created(before, report, energy(model, state)), 0.0) << "step " << n;
    slept = std::max(slept, report.asleep);
  }
  EXPECT_GE(slept, 15);
  EXPECT_LE((total_momentum(state) - start).norm(), 1e-11 * start.norm());
  const Energy before = energy(model, state);
  State woken = state;
  wake(model, woken);
  const Energy after = energy(model, woken);
  EXPECT_NEAR(after.total(), before.total(), before.rounding + after.rounding);
  EXPECT_LE((total_momentum(woken) - start).norm(), 1e-11 * start.norm());
  EXPECT_LE(largest_distance(model, woken, state), 0.0);
}

TEST(Sleep, PulledLimb_WakesWithItsPathAlone) {
  const Model model(doll_52());
  State state = settled(model);
  Workspace workspace(model);
  const Coupling right = grip(model, state, kRightLeg + 2);
  const Inputs still{.couplings = {&right, 1}};
  advance_for(model, state, workspace, 1.0, still);
  ASSERT_TRUE(state.bodies[kLeftFingers].asleep);
  const Pulls pulls({{.body = kLeftFingers,
                      .force = {0.0, 0.0, 0.002},
                      .start = 0.0,
                      .end = 100.0,
                      .shape = Pull::Shape::kConstant}});
  const Inputs pulled{.loads = &pulls, .couplings = {&right, 1}};
  const StepReport report = step(model, state, workspace, pulled, {.step = kH, .sleep_angle = kSleepAngle});
  EXPECT_FALSE(state.bodies[kLeftFingers].asleep);
  EXPECT_FALSE(state.bodies[kLeftHand].asleep);
  EXPECT_TRUE(state.bodies[kLeftFingers + 3].asleep) << "the next finger";
  EXPECT_GT(report.asleep, 15);
}

TEST(Sleep, PullThatEndsAfterAPause_WakesWhatItHeld) {
  // An arm on a pinned root: every joint that sleeps transmits the pull.
  ModelDefinition definition;
  definition.root = RootKind::kFree;
  for (int i = 0; i < 3; ++i) {
    BodyDefinition body;
    body.name = "body" + std::to_string(i);
    body.parent = i - 1;
    body.mass = 0.2;
    body.com = {0.1, 0, 0};
    if (i > 0) body.anchor = {0.2, 0, 0};
    body.inertia = Eigen::Vector3d(1e-4, 7e-4, 7e-4).asDiagonal();
    body.joint = {.stiffness = 40.0, .damping = 0.4, .flow_damping = 2.0, .yield_torque = 3.0};
    definition.bodies.push_back(body);
  }
  const Model model(definition);
  State state = initial_state(model);
  Workspace workspace(model);
  Coupling pin = grip(model, state, 0);
  pin.stiffness = 1e4;
  pin.angular_stiffness = 100.0;
  pin.angular_damping = 2.0;
  const std::vector<Coupling> alone{pin};
  advance_for(model, state, workspace, 5.0, {.couplings = alone}, 0.0);
  const State before = state;
  std::vector<Coupling> held{pin, grip(model, state, 2)};
  held[1].target_position.z() += 0.02;
  ASSERT_TRUE(advance_for(model, state, workspace, 5.0, {.couplings = held}).resting);
  ASSERT_GT(largest_distance(model, state, before), 0.01);
  advance_for(model, state, workspace, 5.0, {.couplings = alone});
  constexpr double kReach = 0.9;  // [m] sum of the joints' distances from the end
  EXPECT_LT(largest_distance(model, state, before), kReach * kSleepAngle);
}

TEST(Sleep, SoftenedSleeper_WakesAndFlows) {
  const Model model(doll_52());
  State state = settled(model);
  Workspace workspace(model);
  ASSERT_TRUE(advance_for(model, state, workspace, 2.0).resting);
  // A joint that gravity strains, made softer than its load.
  constexpr int kArm = 7;
  ASSERT_GT(state.bodies[kArm].torque.norm(), 0.01);
  state.bodies[kArm].yield_scale = 0.2 * state.bodies[kArm].torque.norm() / model.body(kArm).joint.yield_torque;
  advance_for(model, state, workspace, 0.1);
  EXPECT_GT(state.bodies[kArm].flow, 0.0);
}

TEST(Sleep, ShakenRoot_WakesWhatItBends) {
  ModelDefinition definition = doll_52();
  definition.root = RootKind::kFree;
  const Model model(definition);
  State asleep = initial_state(model);
  Coupling pin = grip(model, asleep, 0);
  pin.stiffness = 1e6;
  pin.damping = 1e4;
  pin.angular_stiffness = 1e5;
  pin.angular_damping = 1e3;
  Workspace a(model), b(model);
  advance_for(model, asleep, a, 40.0, {.couplings = {&pin, 1}}, 0.0);
  advance_for(model, asleep, a, 1.0, {.couplings = {&pin, 1}});
  State awake = asleep;
  wake(model, awake);
  double most = 0.0;
  int least_asleep = model.size();
  for (int n = 0; n < 1000; ++n) {
    const Coupling now = moved(pin, n * kH);
    const StepReport report =
        step(model, asleep, a, {.couplings = {&now, 1}}, {.step = kH, .sleep_angle = kSleepAngle});
    ASSERT_EQ(step(model, awake, b, {.couplings = {&now, 1}}, {.step = kH}).status, StepStatus::kOk);
    most = std::max(most, largest_distance(model, asleep, awake));
    least_asleep = std::min(least_asleep, report.asleep);
  }
  EXPECT_LE(most, kPoseTolerance);
  EXPECT_LE(least_asleep, 45);
}

TEST(Sleep, SavedWhileSomeSleep_GoesOnWithTheSameBits) {
  const Model model(doll_52());
  State state = settled(model);
  Workspace workspace(model);
  const Coupling start = grip(model, state, kLeftHand);
  const auto run = [&](State& from, Workspace& scratch, int begin, int end) {
    for (int n = begin; n < end; ++n) {
      const Coupling now = moved(start, n * kH);
      (void)step(model, from, scratch, {.couplings = {&now, 1}}, {.step = kH, .sleep_angle = kSleepAngle});
    }
  };
  run(state, workspace, 0, 500);
  State restored = state;
  Workspace fresh(model);
  run(state, workspace, 500, 1500);
  run(restored, fresh, 500, 1500);
  for (std::size_t i = 0; i < state.bodies.size(); ++i) {
    EXPECT_EQ(state.bodies[i].rotation.coeffs(), restored.bodies[i].rotation.coeffs());
    EXPECT_EQ(state.bodies[i].angular_momentum, restored.bodies[i].angular_momentum);
    EXPECT_EQ(state.bodies[i].asleep, restored.bodies[i].asleep);
  }
}

/// Links of a chain in the definition's frames, the joints from `first` to `last` welded.
ModelDefinition welded_chain(int first, int last) {
  ModelDefinition definition = chain({.links = 8, .bend = 0.2}).definition;
  for (BodyDefinition& body : definition.bodies) body.rest_rotation = body.rotation;
  for (int i = first; i <= last; ++i) definition.bodies[i].joint.stiffness = INFINITY;
  return definition;
}

TEST(Sleep, WeldedJoints_MoveAsVeryStiffOnesAndCostNothing) {
  for (const int order : {1, 4}) {
    const Model welded(welded_chain(3, 5));
    ModelDefinition definition = welded_chain(3, 5);
    for (int i = 3; i <= 5; ++i) definition.bodies[i].joint.stiffness = 0.99 * kRigidStiffness;
    const Model stiff(definition);
    State a = initial_state(welded);
    State b = initial_state(stiff);
    Workspace wa(welded), wb(stiff);
    Coupling coupling{.body = 4, .point = {0.05, 0.02, 0.0}, .stiffness = 50.0, .damping = 1.0};
    coupling.target_position = {0.3, 0.1, 0.1};
    const Pulls pulls({{.body = 5, .force = {0.1, 0.2, 0.0}, .start = 0.0, .end = 0.5}});
    const Inputs inputs{.loads = &pulls, .couplings = {&coupling, 1}};
    for (int n = 0; n < 500; ++n) {
      const StepReport report = step(welded, a, wa, inputs, {.step = kH, .order = order});
      ASSERT_EQ(report.status, StepStatus::kOk);
      EXPECT_EQ(report.asleep, 3);
      ASSERT_EQ(step(stiff, b, wb, inputs, {.step = kH, .order = order}).status, StepStatus::kOk);
    }
    // Loads of some newtons bend a joint of 1e9 N m/rad by 1e-9 rad. Base steps of one body and of four that move as
    // one differ in the second order of h.
    EXPECT_LE(largest_distance(welded, a, b), order == 1 ? 1e-5 : 1e-7) << "order " << order;
    EXPECT_GT(largest_distance(welded, a, initial_state(welded)), 0.01);
    EXPECT_NEAR(energy(welded, a).kinetic, energy(stiff, b).kinetic, 1e-6);
  }
}

}  // namespace
}  // namespace layfigure::testing
