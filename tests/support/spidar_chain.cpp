#include "spidar_chain.h"

#include <algorithm>
#include <cmath>

#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using Eigen::Vector3d;
using haptics::PortWrench;

// The hand begins this far in front of the wall, at x = 0, and wants to be so far behind it [m].
constexpr double kApproach = 2e-3;
constexpr double kPressed = 1e-2;

spidar::HandModel pressing(Press press) {
  spidar::HandModel hand;
  if (press == Press::kHand) return hand;
  constexpr double kNothing = 1e-3;
  hand.mass = kNothing;
  hand.arm_damping = kNothing;
  hand.grip_damping = kNothing;
  return hand;
}

}  // namespace

void VelocityFilter::add(const spidar::Pose& pose, double h) {
  if (last_) {
    const double share = h / (h + time_constant_);
    linear_ += share * ((pose.position - last_->position) / h - linear_);
    const Vector3d turn = math::log_rotation(pose.rotation * last_->rotation.conjugate());
    angular_ += share * (turn / h - angular_);
  }
  last_ = pose;
}

SpidarChain::SpidarChain(const spidar::Geometry& geometry, const Options& options)
    : h_(1.0 / options.rate_hz),
      device_(geometry, options.parts),
      poses_(device_.geometry()),
      tensions_(device_.geometry(), options.reference_tension),
      velocity_(options.velocity_filter) {}

void SpidarChain::tick(const spidar::Pose& wanted, const Rendering& rendering) {
  spidar::Wrench wrench = spidar::Wrench::Zero();
  spidar::Pose pose;
  if (const auto lengths = device_.read()) {
    const spidar::PoseEstimate estimate = poses_.solve(*lengths);
    pose = estimate.pose;
    if (estimate.converged) {
      velocity_.add(pose, h_);
      measured_ = {.position = pose.position,
                   .rotation = pose.rotation,
                   .velocity = velocity_.linear(),
                   .angular_velocity = velocity_.angular()};
      const PortWrench felt = rendering(measured_);
      wrench << felt.force, felt.torque;
    }
  }
  device_.command(tensions_.solve(pose, wrench).tensions);
  const Vector3d before = device_.grip().position;
  device_.advance(h_, wanted);
  speed_ = (device_.grip().position - before).norm() / h_;
}

void RestCheck::add(double time, double speed) {
  if (time < kFrom) return;
  sum_ += speed * speed;
  ++count_;
}

bool RestCheck::holds() const { return count_ > 0 && std::sqrt(sum_ / static_cast<double>(count_)) < kAtRest; }

bool ideal_wall_holds(double stiffness, double rate_hz, double step) {
  constexpr double kLongest = 5e-6;  // of the integration [s]
  const spidar::SimulatedParts parts;
  const spidar::HandModel& hand = parts.hand;
  const int parts_of_tick = std::max(1, static_cast<int>(std::ceil(1.0 / rate_hz / kLongest)));
  const double h = 1.0 / rate_hz / parts_of_tick;
  const double arm = h * (h * hand.arm_stiffness + hand.arm_damping);
  const double skin = h * (h * hand.grip_stiffness + hand.grip_damping);
  const double a = hand.mass + arm + skin;
  const double b = parts.grip_mass + skin;
  const double determinant = a * b - skin * skin;
  double x_hand = -kApproach, x_grip = -kApproach, v_hand = 0.0, v_grip = 0.0;
  RestCheck check;
  for (long k = 0; static_cast<double>(k) < RestCheck::kUntil * rate_hz; ++k) {
    const double seen = std::round(x_grip / step) * step;
    const double force = seen > 0.0 ? -stiffness * seen : 0.0;
    const double before = x_grip;
    for (int i = 0; i < parts_of_tick; ++i) {
      const double pull = h * hand.grip_stiffness * (x_hand - x_grip);
      const double p_hand = hand.mass * v_hand - h * hand.arm_stiffness * (x_hand - kPressed) - pull;
      const double p_grip = parts.grip_mass * v_grip + h * force + pull;
      v_hand = (b * p_hand + skin * p_grip) / determinant;
      v_grip = (skin * p_hand + a * p_grip) / determinant;
      x_hand += h * v_hand;
      x_grip += h * v_grip;
    }
    check.add(static_cast<double>(k) / rate_hz, (x_grip - before) * rate_hz);
  }
  return check.holds();
}

bool chain_wall_holds(const spidar::Geometry& geometry, const SpidarChain::Options& options, Press press,
                      double stiffness, double damping) {
  SpidarChain::Options chosen = options;
  chosen.parts.hand = pressing(press);
  SpidarChain chain(geometry, chosen);
  spidar::Pose wanted;
  const auto wall = [&](const haptics::CouplingTarget& device) -> PortWrench {
    const double depth = device.position.x();
    if (depth <= 0.0) return {};
    const double push = stiffness * depth + damping * device.velocity.x();
    return {.force = {-std::max(push, 0.0), 0.0, 0.0}, .torque = Vector3d::Zero()};
  };
  RestCheck check;
  for (long k = 0; static_cast<double>(k) < RestCheck::kUntil * options.rate_hz; ++k) {
    const double time = static_cast<double>(k) / options.rate_hz;
    wanted.position.x() = kPressed;
    chain.tick(wanted, wall);
    check.add(time, chain.speed());
  }
  return check.holds();
}

double largest_stiffness(const std::function<bool(double)>& holds) {
  constexpr double kLeast = 1000.0;
  constexpr double kMost = 60'000.0;
  constexpr double kRung = 1.01;
  double reached = 0.0;
  for (double stiffness = kLeast; stiffness <= kMost && holds(stiffness); stiffness *= kRung) reached = stiffness;
  return reached;
}

}  // namespace layfigure::testing
