// The doll's rows: what is felt of it, energy, rest, times of ticks and steps.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <string>

#include "haptic_rig.h"
#include "haptics.h"
#include "random_contacts.h"
#include "scene.h"
#include "tick_times.h"
#include "touching_scenes.h"

namespace layfigure::bench {
namespace {

using haptics::CouplingGains;
using haptics::CouplingTarget;
using testing::FullRig;
using testing::Hand;
using testing::HapticRig;
using testing::HeldScene;
using testing::MultirateRig;

constexpr double kHapticRate = 10'000.0;
constexpr double kPhysicsRate = 1000.0;
constexpr double kContactPhysicsRate = 500.0;
constexpr double kContactHapticRate = 1000.0;
constexpr double kFelt = 3.0;         // [%]
constexpr double kDeepestDip = 1e-3;  // [J]
constexpr double kDrift = 0.01;       // [deg]
constexpr double kAmplitude = 2e-3;   // of the hand [m]

CouplingGains grab(int hands) {
  CouplingGains gains{.stiffness = 1000.0, .damping = 5.0};
  if (hands > 1) {
    gains.angular_stiffness = 1.0;
    gains.angular_damping = 0.01;
  }
  return gains;
}

/// Force by displacement at a frequency, of the hand that moves; a second one moves half as far the other way.
std::complex<double> dynamic_stiffness(HapticRig& rig, const HeldScene& held, double frequency) {
  constexpr double kLeastSettling = 2.0;
  const double rate = 2.0 * std::numbers::pi * frequency;
  std::vector<Hand> hands;
  for (std::size_t k = 0; k < held.pointers.size(); ++k) {
    const CouplingTarget home = held_pose(held, static_cast<int>(k));
    const double amplitude = k == 0 ? kAmplitude : -0.5 * kAmplitude;
    hands.emplace_back([=](double time) {
      CouplingTarget target = home;
      target.position.z() += amplitude * std::sin(rate * time);
      target.velocity.z() += amplitude * rate * std::cos(rate * time);
      return target;
    });
  }
  const double settling = std::max(kLeastSettling, 2.0 / frequency);
  const double end = settling + std::ceil(frequency) / frequency;
  std::complex<double> force = 0.0;
  std::complex<double> displacement = 0.0;
  while (rig.time() < end - 0.5 / kHapticRate) {
    const double time = rig.time();
    const double felt = rig.tick(hands)[0].force.z();
    if (time < settling - 0.5 / kHapticRate) continue;
    const std::complex<double> turn = std::polar(1.0, -rate * time);
    force -= felt * turn;
    displacement += kAmplitude * std::sin(rate * time) * turn;
  }
  return force / displacement;
}

void tell_felt_by(int count, const HapticsEffort& effort, std::vector<Figure>& figures) {
  const HeldScene held = testing::held_doll(count, grab(count));
  double real = 0.0;
  double whole = 0.0;
  for (const double frequency : effort.frequencies) {
    FullRig full(held, kHapticRate);
    MultirateRig local(held, kPhysicsRate, kHapticRate);
    const std::complex<double> expected = dynamic_stiffness(full, held, frequency);
    const std::complex<double> difference = dynamic_stiffness(local, held, frequency) - expected;
    real = std::max(real, 100.0 * std::abs(difference.real()) / std::abs(expected));
    whole = std::max(whole, 100.0 * std::abs(difference) / std::abs(expected));
  }
  const std::string name = std::string("felt by ") + (count == 1 ? "one hand" : "two hands") + ", 0-10 Hz: ";
  figures.push_back({name + "stiffness and mass off the full model, most", real, "%", kFelt});
  figures.push_back({name + "the same with what is felt as damping, most", whole, "%"});
}

/// Force of a doll held a little off its rest [N/m].
double static_stiffness(const HeldScene& held, double physics_hz) {
  constexpr double kOff = 1e-2;
  constexpr double kSettling = 20.0;
  constexpr double kRate = 1000.0;
  CouplingTarget target = held_pose(held, 0);
  target.position.z() += kOff;
  const std::vector<Hand> hand{[target](double) { return target; }};
  MultirateRig rig(held, physics_hz, kRate);
  while (rig.time() < kSettling) (void)rig.tick(hand);
  return rig.tick(hand)[0].force.norm() / kOff;
}

void tell_rates(std::vector<Figure>& figures) {
  const HeldScene held = testing::held_doll(1, grab(1));
  const double fast = static_stiffness(held, 500.0);
  const double slow = static_stiffness(held, 50.0);
  figures.push_back({"felt stiffness, physics at 500 Hz", fast, "N/m"});
  figures.push_back({"felt stiffness, change from 50 to 500 Hz", 100.0 * std::abs(slow / fast - 1.0), "%", kFelt});
}

void tell_local_tick(const std::string& name, const HeldScene& held, const CouplingTarget& target, long ticks,
                     std::vector<Figure>& figures) {
  std::vector<Hand> hands(held.pointers.size(), [target](double) { return target; });
  for (std::size_t k = 1; k < hands.size(); ++k) {
    const CouplingTarget other = held_pose(held, static_cast<int>(k));
    hands[k] = [other](double) { return other; };
  }
  MultirateRig rig(held, kPhysicsRate, kHapticRate);
  while (rig.time() < 0.5) (void)rig.tick(hands);
  haptics::LocalDynamics local = {};
  local.hand_over(rig.model());
  std::vector<CouplingTarget> targets;
  for (const Hand& hand : hands) targets.push_back(hand(0.0));
  std::vector<haptics::PortWrench> felt(hands.size());
  const CallTimes times = time_calls(ticks, [&](long) { local.tick(targets, felt); });
  figures.push_back({"local tick, " + name + ", median", times.median, "us"});
  figures.push_back({"local tick, " + name + ", p99.9", times.p99_9, "us"});
}

/// The whole step in the haptic tick: the rates that its p99.9 fits.
void tell_whole_step(const std::string& name, const scene::SceneDefinition& definition, const dynamics::State& start,
                     long ticks, std::vector<Figure>& figures) {
  scene::Scene scene(definition);
  dynamics::State state = start;
  constexpr double kSettling = 3.0;
  for (int k = 0; k < static_cast<int>(kSettling * kPhysicsRate); ++k) {
    (void)scene.step(state, {}, {.step = 1.0 / kPhysicsRate});
  }
  const CallTimes times = time_calls(ticks, [&](long) { (void)scene.step(state, {}, {.step = 1.0 / kHapticRate}); });
  double fits = 0.0;
  for (const double rate_khz : {1.0, 4.0, 10.0}) {
    if (times.p99_9 * rate_khz <= 1000.0) fits = rate_khz;
  }
  figures.push_back({"whole step, " + name + ", median", times.median, "us"});
  figures.push_back({"whole step, " + name + ", p99.9", times.p99_9, "us"});
  figures.push_back({"whole step, " + name + ": fits", fits, "kHz"});
}

void tell_energy_by(int hands, const HapticsEffort& effort, std::vector<Figure>& figures) {
  const testing::ContactEnergy found =
      testing::run_random_contacts(hands, effort.contacts, kContactPhysicsRate, kContactHapticRate);
  const std::string name =
      std::to_string(found.contacts) + " random contacts of " + (hands == 1 ? "one hand: " : "two hands: ");
  figures.push_back({name + "net energy generated", -found.taken_in, "J", 0.0});
  figures.push_back({name + "deepest dip of the hand-over", -found.lowest_hand_over, "J", kDeepestDip});
  figures.push_back({name + "booked of what steps lost", found.booked, "J"});
  figures.push_back({name + "lost by steps", found.lost, "J"});
  figures.push_back({name + "booked of a step more than it lost, most", found.overbooked, "J", 0.0});
  figures.push_back({name + "problems not solved", static_cast<double>(found.unsolved), "", 0.0});
  if (hands > 1) figures.push_back({name + "begun while the other touched", static_cast<double>(found.together), ""});
}

dynamics::State start_of(const dynamics::ModelDefinition& definition) {
  return initial_state(dynamics::Model(definition));
}

}  // namespace

void tell_energy(const HapticsEffort& effort, std::vector<Figure>& figures) {
  for (const int hands : {1, 2}) tell_energy_by(hands, effort, figures);
}

void tell_felt(const HapticsEffort& effort, std::vector<Figure>& figures) {
  for (const int hands : {1, 2}) tell_felt_by(hands, effort, figures);
  tell_rates(figures);
}

/// The doll hangs with its joints just below yield.
void tell_rest(const HapticsEffort& effort, std::vector<Figure>& figures) {
  constexpr double kStep = 2e-3;
  constexpr double kMargin = 1.25;       // of the yield torques over what the joints bear
  constexpr double kLeastTorque = 1e-4;  // [N m]
  constexpr double kFlowDamping = 0.1;   // of the damping: what flows would flow at once
  HeldScene held = testing::held_doll(1, grab(1));
  dynamics::ModelDefinition definition = held.definition.model;
  for (std::size_t i = 0; i < definition.bodies.size(); ++i) {
    dynamics::JointLaw& law = definition.bodies[i].joint;
    law.yield_torque = kMargin * std::max(held.start.bodies[i].torque.norm(), kLeastTorque);
    law.flow_damping = kFlowDamping * law.damping;
  }
  scene::Scene scene({.model = definition, .shapes = {}, .excluded = {}});
  dynamics::State state = held.start;
  for (long k = 0; static_cast<double>(k) * kStep < effort.rest; ++k) (void)scene.step(state, {}, {.step = kStep});
  double drift = 0.0;
  for (std::size_t i = 0; i < state.bodies.size(); ++i) {
    drift = std::max(drift, state.bodies[i].rotation.angularDistance(held.start.bodies[i].rotation));
  }
  figures.push_back({"pose left alone for " + std::to_string(static_cast<long>(effort.rest)) + " s: drift, most",
                     drift * 180.0 / std::numbers::pi, "deg", kDrift});
}

void tell_tick_times(const HapticsEffort& effort, std::vector<Figure>& figures) {
  const HeldScene held = testing::held_doll(2, grab(2));
  tell_local_tick("doll-52 in two hands", held, held_pose(held, 0), effort.ticks, figures);
  const HeldScene touched = testing::touched_limb({{.stiffness = 800.0, .damping = 4.0}});
  CouplingTarget pressed = held_pose(touched, 0);
  pressed.position.z() -= 8e-3;
  tell_local_tick("a touch with friction", touched, pressed, effort.ticks, figures);
  tell_whole_step("doll-52", held.definition, held.start, effort.ticks, figures);
  for (const int links : {200, 1000}) {
    const testing::Scene chain = testing::chain({.links = links, .bend = 0.1});
    const long steps = std::max(effort.ticks / links, 100L);
    tell_whole_step("chain-" + std::to_string(links), {.model = chain.definition, .shapes = {}, .excluded = {}},
                    start_of(chain.definition), steps, figures);
  }
  constexpr double kHeight = 1.0;  // the legs are 0.78 m long
  const scene::SceneDefinition fallen = testing::capsule_doll(kHeight, INFINITY);
  tell_whole_step("capsule doll on a floor", fallen, start_of(fallen.model), std::max(effort.ticks / 100, 100L),
                  figures);
}

}  // namespace layfigure::bench
