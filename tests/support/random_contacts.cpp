#include "random_contacts.h"

#include <algorithm>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "haptic_rig.h"

namespace layfigure::testing {
namespace {

using Eigen::Vector3d;
using haptics::CouplingTarget;

/// A tap: towards the limb from a side of it, along and away again, as a smooth path with its velocity.
class Tap {
 public:
  Tap(double start, double side, std::mt19937& random) : start_(start) {
    const auto between = [&random](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    duration_ = between(0.02, 0.08);
    depth_ = side * between(0.003, 0.012);
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
  double depth_;  ///< along -z
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

/// A hand that taps, and what it felt.
class TappingHand {
 public:
  TappingHand(const HeldScene& held, int k, std::mt19937& random)
      : home_(held_pose(held, k)), side_(home_.position.z() > 0.0 ? 1.0 : -1.0), tap_(0.0, side_, random) {}

  [[nodiscard]] CouplingTarget at(double time) const {
    CouplingTarget target = home_;
    tap_.add(time, target);
    return target;
  }
  void begin(double time, std::mt19937& random) {
    if (time >= tap_.end()) tap_ = Tap(time, side_, random);
  }
  /// Whether a contact began.
  bool feel(double time, const haptics::PortWrench& felt) {
    work_.add(at(time), felt);
    const bool before = touches_;
    touches_ = side_ * felt.force.z() > kTouching;
    return touches_ && !before;
  }
  [[nodiscard]] bool touches() const { return touches_; }
  [[nodiscard]] double work() const { return work_.work(); }

 private:
  CouplingTarget home_;
  double side_;
  Tap tap_;
  HandWork work_;
  bool touches_{false};
};

/// Taps with balls of the same stiffness, until there have been so many more contacts.
void add_series(const HeldScene& held, double physics_hz, double haptic_hz, std::mt19937& random,
                ContactEnergy& found) {
  MultirateRig rig(held, physics_hz, haptic_hz);
  std::vector<TappingHand> tapping;
  for (int k = 0; k < static_cast<int>(held.pointers.size()); ++k) tapping.emplace_back(held, k, random);
  std::vector<Hand> hands;
  for (const TappingHand& hand : tapping) {
    hands.emplace_back([&hand](double time) { return hand.at(time); });
  }
  LossCheck losses(rig);
  const long end = found.contacts + kSeries;
  while (found.contacts < end) {
    const double time = rig.time();
    for (TappingHand& hand : tapping) hand.begin(time, random);
    const std::span<const haptics::PortWrench> felt = rig.tick(hands);
    losses.tick(found);
    for (std::size_t k = 0; k < tapping.size(); ++k) {
      found.largest_force = std::max(found.largest_force, felt[k].force.norm());
      if (!tapping[k].feel(time, felt[k])) continue;
      ++found.contacts;
      if (std::ranges::count_if(tapping, &TappingHand::touches) > 1) ++found.together;
    }
  }
  for (const TappingHand& hand : tapping) found.taken_in += hand.work();
  found.lowest_hand_over = std::min(found.lowest_hand_over, rig.local().ledger().lowest);
  found.unsolved += rig.local().unsolved();
}

}  // namespace

ContactEnergy run_random_contacts(int hands, long contacts, double physics_hz, double haptic_hz) {
  ContactEnergy found;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> stiffness(100.0, 2000.0);
  std::uniform_real_distribution<double> damping(0.5, 6.0);
  while (found.contacts < contacts) {
    std::vector<haptics::CouplingGains> gains;
    for (int k = 0; k < hands; ++k) {
      haptics::CouplingGains& own = gains.emplace_back();
      own.stiffness = stiffness(random);
      own.damping = damping(random);
    }
    add_series(touched_limb(gains), physics_hz, haptic_hz, random, found);
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
