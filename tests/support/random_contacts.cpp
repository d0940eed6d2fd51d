#include "random_contacts.h"

#include <algorithm>
#include <numbers>
#include <random>

#include "haptic_rig.h"

namespace layfigure::testing {
namespace {

using Eigen::Vector3d;
using haptics::CouplingTarget;

/// A tap: down, along and up again, as a smooth path with its velocity.
class Tap {
 public:
  Tap(double start, std::mt19937& random) : start_(start) {
    const auto between = [&random](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    duration_ = between(0.02, 0.08);
    depth_ = between(0.003, 0.012);
    along_ = {between(-0.02, 0.02), between(-0.01, 0.01), 0.0};
  }
  [[nodiscard]] double end() const { return start_ + duration_; }
  void add(double time, CouplingTarget& target) const {
    const double s = std::clamp((time - start_) / duration_, 0.0, 1.0);
    const double phase = 2.0 * std::numbers::pi * s;
    const double rate = 2.0 * std::numbers::pi / duration_;
    target.position.z() -= 0.5 * depth_ * (1.0 - std::cos(phase));
    target.velocity.z() -= 0.5 * depth_ * rate * std::sin(phase);
    target.position += 0.5 * std::sin(phase) * along_;
    target.velocity += 0.5 * rate * std::cos(phase) * along_;
  }

 private:
  double start_;
  double duration_;
  double depth_;
  Vector3d along_;
};

/// Adds the work that a hand did on its way from one target to the next against what it felt.
class HandWork {
 public:
  void add(const CouplingTarget& now, const haptics::PortWrench& felt) {
    if (known_) work_ -= felt_.dot(now.position - last_);
    last_ = now.position;
    felt_ = felt.force;
    known_ = true;
  }
  [[nodiscard]] double work() const { return work_; }

 private:
  bool known_{false};
  Vector3d last_{Vector3d::Zero()};
  Vector3d felt_{Vector3d::Zero()};
  double work_{0.0};
};

/// Compares what the hand-over books of steps' losses with what they lose.
class LossCheck {
 public:
  explicit LossCheck(MultirateRig& rig) : rig_(rig) { rig.measure_losses(); }
  /// After each tick: the ledger of the hand-over changes when physics has answered.
  void tick(ContactEnergy& found) {
    const double booked = rig_.local().ledger().lost - booked_;
    const bool stepped = rig_.state().time != time_;
    if (!stepped && booked == 0.0) return;
    found.booked += booked;
    found.lost += rig_.step_loss();
    found.overbooked = std::max(found.overbooked, booked - rig_.step_loss() - rig_.step_rounding());
    booked_ += booked;
    time_ = rig_.state().time;
  }

 private:
  MultirateRig& rig_;
  double booked_{0.0};
  double time_{0.0};
};

// A contact begins where the force rises above this [N].
constexpr double kTouching = 0.05;
// Contacts of one stiffness.
constexpr long kSeries = 250;
constexpr unsigned kSeed = 20261128;

}  // namespace

ContactEnergy run_random_contacts(long contacts, double physics_hz, double haptic_hz) {
  ContactEnergy found;
  std::mt19937 random(kSeed);
  while (found.contacts < contacts) {
    std::uniform_real_distribution<double> stiffness(100.0, 2000.0);
    std::uniform_real_distribution<double> damping(0.5, 6.0);
    const HeldScene held = touched_limb({.stiffness = stiffness(random), .damping = damping(random)});
    const CouplingTarget home = held_pose(held, 0);
    MultirateRig rig(held, physics_hz, haptic_hz);
    Tap tap(0.0, random);
    const std::vector<Hand> hand{[&](double time) {
      CouplingTarget target = home;
      tap.add(time, target);
      return target;
    }};
    HandWork work;
    LossCheck losses(rig);
    bool touching = false;
    const long before = found.contacts;
    while (found.contacts < before + kSeries) {
      const double time = rig.time();
      if (time >= tap.end()) tap = Tap(time, random);
      const haptics::PortWrench felt = rig.tick(hand)[0];
      work.add(hand[0](time), felt);
      losses.tick(found);
      found.largest_force = std::max(found.largest_force, felt.force.norm());
      const bool pressed = felt.force.z() > kTouching;
      if (pressed && !touching) ++found.contacts;
      touching = pressed;
    }
    found.taken_in += work.work();
    found.lowest_hand_over = std::min(found.lowest_hand_over, rig.local().ledger().lowest);
    found.unsolved += rig.local().unsolved();
  }
  return found;
}

ContactEnergy shake_doll(double frequency, double physics_hz, double amplitude, double duration) {
  const HeldScene held = held_doll(1, {.stiffness = 1000.0, .damping = 5.0});
  const CouplingTarget home = held_pose(held, 0);
  MultirateRig rig(held, physics_hz, 1000.0);
  const double rate = 2.0 * std::numbers::pi * frequency;
  const std::vector<Hand> hand{[&](double time) {
    CouplingTarget target = home;
    target.position.z() += amplitude * std::sin(rate * time);
    target.velocity.z() += amplitude * rate * std::cos(rate * time);
    return target;
  }};
  HandWork work;
  LossCheck losses(rig);
  ContactEnergy found;
  while (rig.time() < duration) {
    const double time = rig.time();
    const haptics::PortWrench felt = rig.tick(hand)[0];
    work.add(hand[0](time), felt);
    losses.tick(found);
    found.largest_force = std::max(found.largest_force, felt.force.norm());
  }
  found.taken_in = work.work();
  found.lowest_hand_over = rig.local().ledger().lowest;
  return found;
}

}  // namespace layfigure::testing
