#include "layfigure/app/simulation.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "small_doll.h"

namespace layfigure::app {
namespace {

constexpr int kHips = 0;
constexpr int kArm = 2;
constexpr int kTip = 3;

SimulationSettings settings(ClockKind clock = ClockKind::kLockstep) {
  return {.physics_hz = 1000.0, .pose_hz = 60.0, .clock = clock};
}

Simulation make_simulation(ClockKind clock = ClockKind::kLockstep) {
  return Simulation(testing::small_doll(), settings(clock));
}

void run(Simulation& simulation, int steps) {
  for (int i = 0; i < steps; ++i) ASSERT_TRUE(simulation.advance()) << simulation.failure();
}

PointerPose at(const Eigen::Vector3d& position) { return {position, Eigen::Quaterniond::Identity()}; }

double speed(const Simulation& simulation) { return simulation.energy().kinetic; }

const Grip& grip(const Simulation& simulation, int pointer = 0) { return *simulation.pointers().at(pointer).grip(); }

TEST(Simulation, AtRest_ChangesNothingUntilAPointerMoves) {
  Simulation simulation = make_simulation();
  run(simulation, 5000);
  ASSERT_TRUE(simulation.resting());
  const Eigen::Quaterniond pose = simulation.state().bodies[kArm].rotation;
  simulation.rest(1234);
  EXPECT_EQ(simulation.steps(), 6234);
  EXPECT_EQ(simulation.time_us(), 6'234'000);
  const Eigen::Vector3d held = simulation.grab({.bone = kArm});
  EXPECT_FALSE(simulation.resting());
  simulation.point(0, at(held + Eigen::Vector3d(0.0, 0.0, 0.05)), "me", 1);
  simulation.begin_motion(50);
  run(simulation, 100);
  EXPECT_FALSE(simulation.resting());
  EXPECT_GT(simulation.state().bodies[kArm].rotation.angularDistance(pose), 0.01);
  simulation.release(0);
  run(simulation, 10000);
  EXPECT_TRUE(simulation.resting());
}

TEST(Simulation, LeftAlone_HangsFromItsPinAndComesToRest) {
  Simulation simulation = make_simulation();
  run(simulation, 3000);
  EXPECT_LT(simulation.energy().kinetic, 1e-9);
  // The whole weight on the pin: m g / k = 0.6 kg * 9.81 / 1e4 N/m.
  EXPECT_NEAR(simulation.state().bodies[0].position.z(), 1.0 - 0.6 * 9.81 / 1e4, 5e-3);
}

constexpr double kThickness = 0.04;  // [m] of a limb, its radius
constexpr double kHalfLength = 0.06;

/// The small doll with limbs as thick as an arm, the middle one left out.
doll::Doll thick_doll() {
  doll::Doll doll = testing::small_doll();
  for (const int body : {0, 2}) {
    collision::ShapeDefinition limb;
    limb.shape = collision::Capsule{.radius = kThickness, .half_length = kHalfLength};
    limb.body = body;
    limb.X_BS.position = doll.definition.bodies[body].com;
    limb.X_BS.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
    doll.shapes.push_back(limb);
  }
  return doll;
}

/// Of the axes of the two thick limbs, at points 1 cm apart.
double limb_distance(const Simulation& simulation) {
  std::vector<dynamics::BodyPose> poses;
  world_poses(dynamics::Model(simulation.doll().definition), simulation.state(), poses);
  double least = std::numeric_limits<double>::infinity();
  for (double a = -kHalfLength; a <= kHalfLength; a += 0.01) {
    for (double b = -kHalfLength; b <= kHalfLength; b += 0.01) {
      const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
      least = std::min(
          least, (poses[0].com + a * (poses[0].rotation * x) - poses[2].com - b * (poses[2].rotation * x)).norm());
    }
  }
  return least;
}

/// Folds the arm back over the hips and presses it against them; the least distance on the way.
double fold_back(doll::Doll doll) {
  Simulation simulation(std::move(doll), settings());
  const Eigen::Vector3d held = simulation.grab({.bone = kTip, .stiffness = 2000.0, .damping = 50.0});
  simulation.point(0, at(held), "test", 1);
  double least = std::numeric_limits<double>::infinity();
  std::int64_t sequence = 1;
  for (const Eigen::Vector3d& to :
       {Eigen::Vector3d(0.3, 0.0, 1.35), Eigen::Vector3d(0.1, 0.0, 1.2), Eigen::Vector3d(0.1, 0.0, 0.9)}) {
    simulation.point(0, at(to), "test", ++sequence);
    simulation.begin_motion(500);
    for (int k = 0; k < 1000; ++k) {
      EXPECT_TRUE(simulation.advance()) << simulation.failure();
      least = std::min(least, limb_distance(simulation));
    }
  }
  return least;
}

TEST(Simulation, ArmPressedAgainstTheBody_StaysOutside) {
  doll::Doll thin = thick_doll();
  thin.shapes.clear();
  EXPECT_LT(fold_back(std::move(thin)), 1.5 * kThickness) << "without shapes it goes through";
  EXPECT_GT(fold_back(thick_doll()), 2.0 * kThickness - 1e-3);
}

TEST(SimulationTime, AfterManySteps_IsExact) {
  Simulation simulation(testing::small_doll(), {.physics_hz = 240.0, .pose_hz = 60.0});
  run(simulation, 1000);
  EXPECT_EQ(simulation.time_us(), 4166667);  // 1000 / 240 s
  EXPECT_DOUBLE_EQ(simulation.state().time, 1000.0 / 240.0);
}

TEST(Grab, Default_HoldsTheCom_AndNothingJumps) {
  Simulation simulation = make_simulation();
  run(simulation, 2000);
  simulation.point(0, at({5, 5, 5}), "test", 1);  // far away: the offset is kept
  const Eigen::Vector3d held = simulation.grab({.bone = kArm});
  EXPECT_TRUE(held.isApprox(simulation.held_pose(grip(simulation)).position));
  run(simulation, 1);
  EXPECT_LT(speed(simulation), 1e-9);
  EXPECT_LT(grip(simulation).force.force.norm(), 1e-3);
}

TEST(Grab, PointOfABone_IsInTheBonesFrame) {
  Simulation simulation = make_simulation();
  const Eigen::Vector3d held = simulation.grab({.bone = kArm, .point = Eigen::Vector3d(0.05, 0.01, 0.02)});
  EXPECT_TRUE(held.isApprox(Eigen::Vector3d(0.45, 0.01, 1.02), 1e-12));
}

TEST(Grab, BoneWithoutBody_HoldsTheBodyThatCarriesIt) {
  Simulation simulation = make_simulation();
  const Eigen::Vector3d held = simulation.grab({.bone = kTip});
  EXPECT_TRUE(held.isApprox(Eigen::Vector3d(0.6, 0, 1), 1e-12));
  EXPECT_EQ(grip(simulation).coupling.body, 2);
  EXPECT_EQ(grip(simulation).bone, kTip);
}

TEST(Grab, Defaults_LetTheDollHang28MillimetresLow) {
  Simulation simulation = make_simulation();
  simulation.grab({.bone = kArm});
  const dynamics::Coupling& coupling = grip(simulation).coupling;
  EXPECT_NEAR(0.6 * 9.81 / coupling.stiffness, 0.0276, 1e-4);
  EXPECT_NEAR(coupling.damping, 2.0 * std::sqrt(0.6 * coupling.stiffness), 1e-9);
  EXPECT_EQ(coupling.angular_stiffness, 0.0);
}

TEST(Grab, WithRotation_HoldsItToo) {
  Simulation simulation = make_simulation();
  simulation.grab({.bone = kArm, .holds_rotation = true});
  const dynamics::Coupling& coupling = grip(simulation).coupling;
  // radius of gyration squared: (1e-4 + 7e-4 + 7e-4) / 2 / 0.2
  EXPECT_NEAR(coupling.angular_stiffness, coupling.stiffness * 3.75e-3, 1e-9);
}

TEST(Grab, Twice_RefusedAndUnchanged) {
  Simulation simulation = make_simulation();
  simulation.grab({.bone = kArm});
  EXPECT_THROW(simulation.grab({.bone = kHips}), std::invalid_argument);
  EXPECT_EQ(grip(simulation).bone, kArm);
}

TEST(Grab, TwoPointers_PullIndependently) {
  Simulation simulation = make_simulation();
  simulation.grab({.pointer = 1, .bone = kTip});
  simulation.grab({.pointer = 0, .bone = kHips});
  simulation.point(1, at({0.6, 0, 1.1}), "test", 1);
  simulation.begin_motion(100);
  run(simulation, 100);
  EXPECT_GT(grip(simulation, 1).force.force.z(), 1.0);
  EXPECT_LT(grip(simulation, 0).force.force.norm(), 0.5 * grip(simulation, 1).force.force.norm());
}

TEST(Release, WithoutGrip_Refused) {
  Simulation simulation = make_simulation();
  EXPECT_THROW(simulation.release(0), std::invalid_argument);
  simulation.point(0, at({0, 0, 0}), "test", 1);
  EXPECT_THROW(simulation.release(0), std::invalid_argument);
}

TEST(Pull, BelowYield_SpringsBack) {
  Simulation simulation = make_simulation();
  run(simulation, 2000);
  const Eigen::Vector3d before = simulation.grab({.bone = kTip});
  simulation.point(0, at(before + Eigen::Vector3d(0, 0, 0.02)), "test", 1);
  simulation.begin_motion(200);
  run(simulation, 400);
  simulation.release(0);
  run(simulation, 4000);
  EXPECT_TRUE(simulation.grab({.bone = kTip}).isApprox(before, 1e-6));
}

TEST(Pull, PastYield_KeepsTheNewPose) {
  Simulation simulation = make_simulation();
  run(simulation, 2000);
  const Eigen::Vector3d before = simulation.grab({.bone = kTip});
  simulation.point(0, at(before + Eigen::Vector3d(-0.1, 0, 0.25)), "test", 1);
  simulation.begin_motion(500);
  int most_yielding = 0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(simulation.advance());
    most_yielding = std::max(most_yielding, simulation.yielding_joints());
  }
  simulation.release(0);
  run(simulation, 4000);
  EXPECT_GT(most_yielding, 0);
  EXPECT_GT(simulation.grab({.bone = kTip}).z(), before.z() + 0.05);
}

TEST(PointLockstep, NewPose_WaitsForTheNextMotion) {
  Simulation simulation = make_simulation();
  const Eigen::Vector3d held = simulation.grab({.bone = kTip});
  simulation.point(0, at(held + Eigen::Vector3d(0, 0, 1)), "test", 1);
  run(simulation, 10);
  EXPECT_EQ(simulation.pointers().at(0).pose().position, held);
  simulation.begin_motion(4);
  run(simulation, 2);
  EXPECT_NEAR(simulation.pointers().at(0).pose().position.z(), held.z() + 0.5, 1e-12);
}

TEST(PointRealtime, SixtyHertz_GlidesOverOneMessageInterval) {
  Simulation simulation = make_simulation(ClockKind::kRealtime);
  const Eigen::Vector3d held = simulation.grab({.bone = kTip});
  for (int i = 1; i <= 20; ++i) {
    run(simulation, 16);
    simulation.point(0, at(held + Eigen::Vector3d(0, 0, 0.001 * i)), "test", i);
  }
  run(simulation, 8);
  EXPECT_NEAR(simulation.pointers().at(0).pose().position.z(), held.z() + 0.0195, 1e-12);
  run(simulation, 8);
  EXPECT_NEAR(simulation.pointers().at(0).pose().position.z(), held.z() + 0.020, 1e-12);
}

TEST(PointRealtime, AfterARest_GlidesOverFiftyMilliseconds) {
  Simulation simulation = make_simulation(ClockKind::kRealtime);
  const Eigen::Vector3d held = simulation.grab({.bone = kTip});
  run(simulation, 1000);
  simulation.point(0, at(held + Eigen::Vector3d(0, 0, 0.05)), "test", 1);
  run(simulation, 25);
  EXPECT_NEAR(simulation.pointers().at(0).pose().position.z(), held.z() + 0.025, 1e-12);
}

TEST(Point, OlderMessageOfTheSameClient_Ignored) {
  Simulation simulation = make_simulation();
  simulation.point(0, at({1, 0, 0}), "a", 5);
  simulation.point(0, at({2, 0, 0}), "a", 4);
  EXPECT_EQ(simulation.pointers().at(0).pose().position.x(), 1.0);
  simulation.point(0, at({3, 0, 0}), "b", 1);
  EXPECT_EQ(simulation.pointers().at(0).pose().position.x(), 3.0);
}

TEST(Reset, AfterAPull_RestoresThePoseAndKeepsTheTime) {
  Simulation simulation = make_simulation();
  const Eigen::Vector3d held = simulation.grab({.bone = kTip});
  simulation.point(0, at(held + Eigen::Vector3d(-0.1, 0, 0.3)), "test", 1);
  simulation.begin_motion(100);
  run(simulation, 300);
  simulation.reset();
  EXPECT_FALSE(simulation.pointers().at(0).grip());
  EXPECT_EQ(simulation.time_us(), 300000);
  EXPECT_TRUE(simulation.grab({.bone = kTip}).isApprox(held, 1e-12));
  EXPECT_EQ(simulation.energy().kinetic, 0.0);
}

TEST(Failure, StepThatWouldNotBeFinite_StopsUntilReset) {
  doll::Doll doll = testing::small_doll();
  doll.definition.gravity = {0, 0, -1e308};
  Simulation simulation(std::move(doll), settings());
  int done = 0;
  while (done < 100 && simulation.advance()) ++done;
  ASSERT_LT(done, 100);
  EXPECT_EQ(simulation.steps(), done);
  EXPECT_NE(simulation.failure().find("step " + std::to_string(done + 1)), std::string::npos) << simulation.failure();
  EXPECT_FALSE(simulation.advance());
  simulation.reset();
  EXPECT_EQ(simulation.failure(), "");
}

TEST(Determinism, SameCalls_SameBits) {
  const auto play = [] {
    Simulation simulation = make_simulation();
    const Eigen::Vector3d held = simulation.grab({.bone = kTip, .holds_rotation = true});
    for (int i = 1; i <= 20; ++i) {
      simulation.point(0, at(held + Eigen::Vector3d(-0.005 * i, 0.002 * i, 0.01 * i)), "test", i);
      simulation.begin_motion(16);
      for (int k = 0; k < 16; ++k) EXPECT_TRUE(simulation.advance());
    }
    return simulation.state();
  };
  const dynamics::State first = play();
  const dynamics::State second = play();
  for (std::size_t i = 0; i < first.bodies.size(); ++i) {
    EXPECT_EQ(first.bodies[i].rotation.coeffs(), second.bodies[i].rotation.coeffs());
    EXPECT_EQ(first.bodies[i].rest_rotation.coeffs(), second.bodies[i].rest_rotation.coeffs());
    EXPECT_EQ(first.bodies[i].angular_momentum, second.bodies[i].angular_momentum);
  }
}

}  // namespace
}  // namespace layfigure::app
