#include "layfigure/haptics/passivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace layfigure::haptics {
namespace {

using Eigen::Vector3d;

constexpr double kTick = 1e-3;

PassivityPort port(const Vector3d& force, const Vector3d& displacement) {
  return {.force = force, .torque = Vector3d::Zero(), .displacement = displacement, .turn = Vector3d::Zero()};
}

TEST(Passivity, Off_ChangesAndRecordsNothing) {
  Passivity passivity;
  PassivityPort moved = port({1.0, 2.0, 3.0}, {1e-3, 0.0, 0.0});
  for (int k = 0; k < 10; ++k) passivity.tick(kTick, {&moved, 1});
  EXPECT_EQ(moved.force, Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(passivity.ledger(0).energy, 0.0);
}

TEST(Passivity, Spring_TakesInWhatTheHandDoes) {
  Passivity passivity;
  passivity.configure({.judge = PassivityOptions::Judge::kEach});
  // A force that pushes back while the hand goes on.
  PassivityPort pushed = port({-2.0, 0.0, 0.0}, Vector3d::Zero());
  passivity.tick(kTick, {&pushed, 1});
  pushed = port({-3.0, 0.0, 0.0}, {1e-3, 0.0, 0.0});
  passivity.tick(kTick, {&pushed, 1});
  EXPECT_DOUBLE_EQ(passivity.ledger(0).energy, 2e-3) << "the force of the tick before acted on this way";
  EXPECT_EQ(pushed.force, Vector3d(-3.0, 0.0, 0.0)) << "passive: nothing to correct";
}

TEST(Passivity, Debt_IsDampedInOneTickWithinTheCap) {
  Passivity passivity;
  passivity.configure({.judge = PassivityOptions::Judge::kEach, .max_damping = 1e6});
  PassivityPort driven = port({1.0, 0.0, 0.0}, Vector3d::Zero());
  passivity.tick(kTick, {&driven, 1});
  driven = port({0.0, 0.0, 0.0}, {1e-3, 0.0, 0.0});
  passivity.tick(kTick, {&driven, 1});
  EXPECT_DOUBLE_EQ(passivity.ledger(0).energy, -1e-3);
  EXPECT_LT(driven.force.x(), 0.0);
  PassivityPort next = port(Vector3d::Zero(), {1e-3, 0.0, 0.0});
  passivity.tick(kTick, {&next, 1});
  EXPECT_NEAR(passivity.ledger(0).energy, 0.0, 1e-12) << "at the same velocity the damping paid it all";
  EXPECT_NEAR(passivity.ledger(0).dissipated, 1e-3, 1e-12);
  EXPECT_DOUBLE_EQ(passivity.ledger(0).lowest, -1e-3);
  EXPECT_EQ(next.force, Vector3d::Zero());
}

TEST(Passivity, DebtBeyondTheCap_IsCarriedOver) {
  Passivity passivity;
  passivity.configure({.judge = PassivityOptions::Judge::kEach, .max_damping = 1.0});
  PassivityPort driven = port({1.0, 0.0, 0.0}, Vector3d::Zero());
  passivity.tick(kTick, {&driven, 1});
  double last = -INFINITY;
  int ticks = 0;
  do {
    driven = port(Vector3d::Zero(), {1e-3, 0.0, 0.0});
    passivity.tick(kTick, {&driven, 1});
    EXPECT_LE(driven.force.norm(), 1.0 * 1.0 + 1e-12) << "1 N s/m at 1 m/s";
    EXPECT_GE(passivity.ledger(0).energy, last);
    last = passivity.ledger(0).energy;
  } while (passivity.ledger(0).energy < -1e-9 && ++ticks < 100);
  EXPECT_LT(ticks, 100);
}

/// A spring wall that acts a tick too late, met by a mass: it makes energy of nothing.
double largest_speed(const PassivityOptions& options) {
  constexpr double kStiffness = 2000.0;
  constexpr double kMass = 0.2;
  Passivity passivity;
  passivity.configure(options);
  double x = -1e-3, v = 0.1, seen = x, felt = 0.0, most = 0.0, before = x;
  for (int k = 0; k < 4000; ++k) {
    PassivityPort tick = port({seen > 0.0 ? -kStiffness * seen : 0.0, 0.0, 0.0}, {x - before, 0.0, 0.0});
    passivity.tick(kTick, {&tick, 1});
    seen = before = x;
    felt = tick.force.x();
    // A hand that presses.
    v += kTick / kMass * (felt + 1.0);
    x += kTick * v;
    if (k > 2000) most = std::max(most, std::abs(v));
  }
  return most;
}

TEST(Passivity, LateWall_ComesToRestOnlyWithTheController) {
  EXPECT_GT(largest_speed({}), 0.1);
  EXPECT_LT(largest_speed({.judge = PassivityOptions::Judge::kEach, .max_damping = 100.0}), 0.5 * largest_speed({}));
}

TEST(Passivity, Pair_EnergyMayPassFromOneHandToTheOther) {
  for (const auto judge : {PassivityOptions::Judge::kEach, PassivityOptions::Judge::kTogether}) {
    Passivity passivity;
    passivity.configure({.judge = judge});
    std::array<PassivityPort, 2> hands;
    for (int k = 0; k < 10; ++k) {
      // One hand pushes against 1 N, the other is pushed by it just as far.
      hands = {port({-1.0, 0.0, 0.0}, {k == 0 ? 0.0 : 1e-4, 0.0, 0.0}),
               port({1.0, 0.0, 0.0}, {k == 0 ? 0.0 : 1e-4, 0.0, 0.0})};
      passivity.tick(kTick, hands);
    }
    EXPECT_NEAR(passivity.together().energy, judge == PassivityOptions::Judge::kTogether ? 0.0 : 0.9e-3, 1e-3);
    EXPECT_LT(passivity.ledger(1).energy, 0.0);
    const bool damped = hands[1].force.x() < 1.0;
    EXPECT_EQ(damped, judge == PassivityOptions::Judge::kEach);
  }
}

TEST(Passivity, GrantedEnergy_MayComeOut) {
  Passivity passivity;
  passivity.configure({.judge = PassivityOptions::Judge::kEach});
  passivity.grant(0, 1.0);
  PassivityPort driven = port({1.0, 0.0, 0.0}, Vector3d::Zero());
  for (int k = 0; k < 10; ++k) {
    driven = port({1.0, 0.0, 0.0}, {k == 0 ? 0.0 : 1e-3, 0.0, 0.0});
    passivity.tick(kTick, {&driven, 1});
    EXPECT_EQ(driven.force, Vector3d::UnitX());
  }
  EXPECT_NEAR(passivity.ledger(0).energy, -9e-3, 1e-12);
  passivity.reset(0);
  EXPECT_EQ(passivity.ledger(0).energy, 0.0);
  EXPECT_NEAR(passivity.together().energy, 0.0, 1e-15);
}

TEST(Passivity, Turns_CountWithTheGripsRadius) {
  Passivity passivity;
  constexpr double kRadius = 0.03;
  passivity.configure({.judge = PassivityOptions::Judge::kEach, .max_damping = 1e9, .radius = kRadius});
  PassivityPort turned{.force = Vector3d::Zero(),
                       .torque = Vector3d::UnitZ(),
                       .displacement = Vector3d::Zero(),
                       .turn = Vector3d::Zero()};
  passivity.tick(kTick, {&turned, 1});
  turned.torque.setZero();
  turned.turn = {0.0, 0.0, 1e-3};
  passivity.tick(kTick, {&turned, 1});
  EXPECT_LT(turned.torque.z(), 0.0);
  turned.torque.setZero();
  passivity.tick(kTick, {&turned, 1});
  EXPECT_NEAR(passivity.ledger(0).energy, 0.0, 1e-12);
}

}  // namespace
}  // namespace layfigure::haptics
