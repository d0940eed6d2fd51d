#include "layfigure/device/guard.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "time_to_no_force.h"

namespace layfigure::device {
namespace {

using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kTick = 1e-3;       // [s]
constexpr double kDeadline = 10e-3;  // [s] from anything that goes wrong to no force

GuardSettings settings() { return {.max_force = 10.0, .max_torque = 0.2, .force_rate = 2000.0, .torque_rate = 40.0}; }

Reading at(double x) { return {.status = Reading::Status::kOk, .position = {x, 0.0, 0.0}}; }

Wrench push(double newtons) { return {.force = {0.0, newtons, 0.0}, .torque = {0.01 * newtons, 0.0, 0.0}}; }

/// A guard with good readings and a force, ticked at 1 kHz.
struct Ticked {
  Guard guard{settings()};
  double time{100.0};
  Wrench last;

  Wrench tick(const Reading& reading = at(0.0), const Wrench& wanted = push(5.0)) {
    time += kTick;
    (void)guard.check(time, reading);
    return last = guard.limit(time, wanted);
  }
  void run(double seconds) {
    for (int k = 0; k < std::lround(seconds / kTick); ++k) (void)tick();
  }
  /// Until the force is fully there.
  void start() {
    run(1.0);
    ASSERT_EQ(guard.report().fault, Fault::kNone);
    ASSERT_EQ(last.force.y(), 5.0);
  }
};

/// Ticks until there is no force; that it falls all the way.
double time_to_none(Ticked& ticked, const Reading& reading, const Wrench& wanted) {
  const double begin = ticked.time;
  double before = ticked.last.force.norm();
  for (int k = 0; k < 100; ++k) {
    const Wrench wrench = ticked.tick(reading, wanted);
    EXPECT_LE(wrench.force.norm(), before);
    EXPECT_LE(wrench.torque.norm(), 0.01 * before + 1e-15);
    before = wrench.force.norm();
    if (wrench.is_zero()) return ticked.time - begin;
  }
  return INFINITY;
}

TEST(Guard, BeforeAnyPose_NoForce) {
  Ticked ticked;
  for (int k = 0; k < 1000; ++k) {
    EXPECT_TRUE(ticked.tick({.status = Reading::Status::kNothingNew}).is_zero());
  }
  EXPECT_EQ(ticked.guard.report().fault, Fault::kNotStarted);
  EXPECT_EQ(ticked.guard.report().trips, 0);
}

TEST(Guard, Start_ForceRisesSoftly) {
  Ticked ticked;
  double before = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double force = ticked.tick().force.norm();
    EXPECT_LE(force - before, 5.0 * kTick / settings().rise_time + 1e-12);
    before = force;
  }
  EXPECT_EQ(before, 5.0);
  EXPECT_EQ(ticked.guard.report().share, 1.0);
}

TEST(Guard, ForceAndTorque_LimitedInSizeAndRate) {
  Ticked ticked;
  ticked.start();
  Wrench before = ticked.last;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-100.0, 100.0);
  for (int k = 0; k < 10'000; ++k) {
    const Wrench wanted{.force = {uniform(random), uniform(random), uniform(random)},
                        .torque = {uniform(random), uniform(random), uniform(random)}};
    const Wrench got = ticked.tick(at(0.0), wanted);
    EXPECT_LE(got.force.norm(), 10.0 * (1.0 + 1e-12));
    EXPECT_LE(got.torque.norm(), 0.2 * (1.0 + 1e-12));
    EXPECT_LE((got.force - before.force).norm(), 2000.0 * kTick * (1.0 + 1e-9));
    EXPECT_LE((got.torque - before.torque).norm(), 40.0 * kTick * (1.0 + 1e-9));
    before = got;
  }
  EXPECT_EQ(ticked.guard.report().fault, Fault::kNone);
}

TEST(Guard, EveryFault_NoForceWithinTenMilliseconds) {
  Reading not_finite = at(kNan);
  Reading not_unit = at(0.0);
  not_unit.rotation.coeffs() *= 1.1;
  Reading turned = at(0.0);
  turned.rotation = Eigen::AngleAxisd(0.5, Vector3d::UnitZ());
  const struct {
    Fault fault;
    Reading reading;
    Wrench wanted;
  } cases[] = {
      {Fault::kSilent, {.status = Reading::Status::kNothingNew}, push(5.0)},
      {Fault::kGone, {.status = Reading::Status::kGone}, push(5.0)},
      {Fault::kInvalid, {.status = Reading::Status::kInvalid}, push(5.0)},
      {Fault::kNotFinite, not_finite, push(5.0)},
      {Fault::kNotFinite, not_unit, push(5.0)},
      {Fault::kBadWrench, at(0.0), push(kNan)},
      {Fault::kBadWrench, at(0.0), push(std::numeric_limits<double>::infinity())},
  };
  for (const auto& [fault, reading, wanted] : cases) {
    Ticked ticked;
    ticked.start();
    const double none = time_to_none(ticked, reading, wanted);
    EXPECT_LE(none, kDeadline + 1e-9) << fault_name(fault);
    testing::tell_time_to_no_force(fault_name(fault), none);
    EXPECT_EQ(ticked.guard.report().fault, fault) << fault_name(fault);
    EXPECT_EQ(ticked.guard.report().trips, 1);
    EXPECT_EQ(ticked.guard.report().share, 0.0);
  }
  for (const Reading& jump : {at(0.05), turned}) {
    Ticked ticked;
    ticked.start();
    (void)ticked.tick(jump);
    EXPECT_EQ(ticked.guard.report().fault, Fault::kJump);
    const double none = kTick + time_to_none(ticked, jump, push(5.0));
    EXPECT_LE(none, kDeadline + 1e-9);
    testing::tell_time_to_no_force(fault_name(Fault::kJump), none);
  }
}

TEST(Guard, PoseThatIsRejected_TheLastGoodOneIsKept) {
  Ticked ticked;
  ticked.start();
  (void)ticked.tick(at(1e-3));
  const Reading rejected = ticked.guard.check(ticked.time + kTick, at(kNan));
  EXPECT_EQ(rejected.status, Reading::Status::kInvalid);
  EXPECT_EQ(rejected.position.x(), 1e-3);
  const Reading jumped = ticked.guard.check(ticked.time + 2 * kTick, at(0.3));
  EXPECT_EQ(jumped.status, Reading::Status::kInvalid);
  EXPECT_EQ(jumped.position.x(), 1e-3);
}

TEST(Guard, ElsewhereForGood_BelievedAfterTheQuietTime) {
  Ticked ticked;
  ticked.start();
  (void)ticked.tick(at(0.3));
  Reading reading;
  double begin = ticked.time;
  do {
    ticked.time += kTick;
    reading = ticked.guard.check(ticked.time, at(0.3));
    (void)ticked.guard.limit(ticked.time, push(5.0));
  } while (reading.status != Reading::Status::kOk && ticked.time < begin + 1.0);
  EXPECT_NEAR(ticked.time - begin, settings().quiet_time, 2 * kTick);
  EXPECT_EQ(reading.position.x(), 0.3);
}

TEST(Guard, AfterAFault_ForceComesBackSoftly) {
  Ticked ticked;
  ticked.start();
  for (int k = 0; k < 30; ++k) (void)ticked.tick({.status = Reading::Status::kNothingNew});
  ASSERT_TRUE(ticked.last.is_zero());
  const double begin = ticked.time;
  double before = 0.0, first = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double force = ticked.tick().force.norm();
    EXPECT_LE(force - before, 5.0 * kTick / settings().rise_time + 1e-12);
    if (force > 0.0 && first == 0.0) first = ticked.time - begin;
    before = force;
  }
  EXPECT_NEAR(first, settings().quiet_time, 3 * kTick);
  EXPECT_EQ(before, 5.0);
  EXPECT_EQ(ticked.guard.report().last_fault, Fault::kSilent);
}

TEST(Guard, TickThatComesTooLate_NoForceAtOnce) {
  Ticked ticked;
  ticked.start();
  ticked.time += 0.05;
  EXPECT_TRUE(ticked.tick().is_zero());
  EXPECT_EQ(ticked.guard.report().fault, Fault::kLate);
}

TEST(Guard, FaultThatComesAgain_DoesNotPutOffTheFading) {
  Ticked ticked;
  ticked.start();
  const double begin = ticked.time;
  for (int k = 1; !ticked.last.is_zero() && ticked.time < begin + 1.0; ++k) {
    (void)ticked.tick(k % 2 == 0 ? at(0.0) : at(kNan), k % 3 == 0 ? push(kNan) : push(5.0));
  }
  EXPECT_LE(ticked.time - begin, kDeadline + 1e-9);
}

/// What is told of a device that is used: stillness is watched.
GuardSettings watchful() {
  GuardSettings watched = settings();
  watched.still_time = GuardSettings::kStillTime;
  return watched;
}

TEST(Guard, PoseThatStandsStillUnderAPush_NoForceBeforeASecondIsOver) {
  Ticked ticked{.guard = Guard(watchful()), .last = {}};
  for (int k = 0; k < 1000; ++k) (void)ticked.tick(at(1e-5 * (k % 2)));
  ASSERT_EQ(ticked.last.force.y(), 5.0);
  const double begin = ticked.time;
  double before = 5.0;
  while (ticked.guard.report().fault == Fault::kNone && ticked.time < begin + 2.0) {
    const double force = ticked.tick().force.norm();
    const double since = ticked.time - begin;
    if (since < watchful().still_time) {
      EXPECT_EQ(force, 5.0);
    } else {
      EXPECT_LE(force, before);
      EXPECT_GE(force - before, -5.0 * kTick / watchful().still_fade - 1e-9) << "softly";
    }
    before = force;
  }
  EXPECT_EQ(ticked.guard.report().fault, Fault::kFrozen);
  EXPECT_NEAR(ticked.time - begin, watchful().still_time + watchful().still_fade, 0.01);
  for (double left = kDeadline; left > 0.0; left -= kTick) (void)ticked.tick();
  for (int k = 0; k < 3000; ++k) {
    EXPECT_TRUE(ticked.tick(at(0.0), k < 1000 ? push(5.0) : push(0.0)).is_zero()) << "until it moves";
  }
  EXPECT_EQ(ticked.guard.report().trips, 1);
  (void)ticked.tick(at(1e-5));
  for (int k = 0; k < 1000; ++k) (void)ticked.tick(at(1e-5 * (k % 2)));
  EXPECT_EQ(ticked.guard.report().fault, Fault::kNone);
  EXPECT_EQ(ticked.last.force.y(), 5.0);
}

TEST(Guard, PoseThatStandsStillWithoutAPushWorthNoticing_IsNoFault) {
  for (const double newtons : {0.0, 0.4}) {
    Ticked ticked{.guard = Guard(watchful()), .last = {}};
    for (int k = 0; k < 5000; ++k) (void)ticked.tick(at(0.0), push(newtons));
    EXPECT_EQ(ticked.last.force.y(), newtons);
    EXPECT_EQ(ticked.guard.report().trips, 0);
  }
}

TEST(Guard, SilenceUnderAPush_StaysSilence) {
  Ticked ticked{.guard = Guard(watchful()), .last = {}};
  ticked.run(0.2);
  for (int k = 0; k < 3000; ++k) (void)ticked.tick({.status = Reading::Status::kNothingNew});
  EXPECT_EQ(ticked.guard.report().fault, Fault::kSilent);
  EXPECT_EQ(ticked.guard.report().trips, 1);
}

TEST(Guard, Closed_NoForceForEver) {
  Ticked ticked;
  ticked.start();
  ticked.guard.close();
  for (int k = 0; k < 2000; ++k) EXPECT_TRUE(ticked.tick().is_zero());
  EXPECT_EQ(ticked.guard.report().fault, Fault::kClosed);
}

TEST(Guard, TimesThatRunBackOrAreNotFinite_CountAsTheLast) {
  Ticked ticked;
  ticked.start();
  for (const double time : {kNan, std::numeric_limits<double>::infinity(), ticked.time - 5.0, 0.0}) {
    (void)ticked.guard.check(time, at(0.0));
    EXPECT_EQ(ticked.guard.limit(time, push(5.0)).force.y(), 5.0) << time;
  }
  EXPECT_EQ(ticked.guard.report().trips, 0);
}

TEST(Guard, RandomFaults_NeverAForceLongAfterOne) {
  Ticked ticked;
  ticked.start();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform;
  double last_fault = -1.0;
  bool faulty = false;
  for (int k = 0; k < 200'000; ++k) {
    if (uniform(random) < 0.01) faulty = !faulty;
    const bool bad = faulty && uniform(random) < 0.9;
    const Wrench wrench = ticked.tick(bad ? at(kNan) : at(0.0));
    if (bad) last_fault = ticked.time;
    const double since = ticked.time - last_fault;
    ASSERT_LE(wrench.force.norm(), 5.0);
    // Between the fading and the quiet time's end there is nothing.
    if (ticked.guard.report().fault != Fault::kNone && since > kDeadline) {
      ASSERT_TRUE(wrench.is_zero()) << k;
    }
  }
  EXPECT_GT(ticked.guard.report().trips, 100);
}

TEST(GuardSettings, Bad_Refused) {
  const auto refused = [](auto change) {
    GuardSettings bad = settings();
    change(bad);
    EXPECT_THROW(Guard{bad}, std::invalid_argument);
  };
  refused([](GuardSettings& s) { s.max_force = -1.0; });
  refused([](GuardSettings& s) { s.max_torque = kNan; });
  refused([](GuardSettings& s) { s.force_rate = std::numeric_limits<double>::infinity(); });
  refused([](GuardSettings& s) { s.fade = 0.0; });
  refused([](GuardSettings& s) { s.patience = -1e-3; });
  refused([](GuardSettings& s) { s.still_time = 0.0; });
  refused([](GuardSettings& s) { s.still_time = kNan; });
  refused([](GuardSettings& s) { s.still_fade = 0.0; });
}

TEST(GuardSettings, OfADevice_WatchStillnessUnlessItIsSimulated) {
  const Info info{.name = "device", .max_force = 10.0, .max_torque = 0.2, .reach = 0.1};
  EXPECT_EQ(GuardSettings::of(info).still_time, GuardSettings::kStillTime);
  Info simulated = info;
  simulated.simulated = true;
  EXPECT_EQ(GuardSettings::of(simulated).still_time, std::numeric_limits<double>::infinity());
}

TEST(GuardSettings, Usual_AreWithinTenMilliseconds) {
  EXPECT_LT(GuardSettings{}.patience + GuardSettings{}.fade, kDeadline - kTick);
}

}  // namespace
}  // namespace layfigure::device
