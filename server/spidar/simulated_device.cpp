#include "layfigure/spidar/simulated_device.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "layfigure/math/rotation.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;

constexpr double kLongestStep = 50e-6;    // [s]: a tenth of the motors' lag
constexpr double kFrictionSpeed = 1e-3;   // [m/s] at which a pulley's friction is fully there
constexpr double kSlackTolerance = 1e-9;  // [m]

void require(double value, const char* name) {
  if (!(value > 0.0 && std::isfinite(value))) {
    throw GeometryError(std::string("simulated device: ") + name + " = " + std::to_string(value) +
                        ", expected above 0");
  }
}

/// Two masses in a row on one axis: arm - hand - skin - grip.
struct Row {
  double hand_mass, grip_mass;
  double arm_stiffness, arm_damping, skin_stiffness, skin_damping;
};

/// Where they are beside where the hand wants to be, and how fast.
struct Motion {
  Vector3d hand, grip;
  Vector3d hand_velocity, grip_velocity;
};

/// Velocities after an implicit Euler step under `force` on the grip:
///     m_h v_h' = m_h v_h - h (k_a (x_h + h v_h') + b_a v_h') - s,   m_g v_g' = m_g v_g + h f + s
///     s = h (k_s (x_h - x_g + h (v_h' - v_g')) + b_s (v_h' - v_g'))
void solve(const Row& row, double h, const Vector3d& force, Motion& motion) {
  const double arm = h * (h * row.arm_stiffness + row.arm_damping);
  const double skin = h * (h * row.skin_stiffness + row.skin_damping);
  const Vector3d pull = h * row.skin_stiffness * (motion.hand - motion.grip);
  const Vector3d hand = row.hand_mass * motion.hand_velocity - h * row.arm_stiffness * motion.hand - pull;
  const Vector3d grip = row.grip_mass * motion.grip_velocity + h * force + pull;
  const double a = row.hand_mass + arm + skin;
  const double b = row.grip_mass + skin;
  const double determinant = a * b - skin * skin;
  motion.hand_velocity = (b * hand + skin * grip) / determinant;
  motion.grip_velocity = (skin * hand + a * grip) / determinant;
}

}  // namespace

SimulatedSpidar::SimulatedSpidar(Geometry geometry, const SimulatedParts& parts)
    : geometry_(std::move(geometry)), parts_(parts) {
  require(parts.hand.mass, "the hand's mass");
  require(parts.hand.radius, "the hand's radius");
  require(parts.hand.arm_stiffness, "the arm's stiffness");
  require(parts.hand.grip_stiffness, "the grip's stiffness");
  require(parts.grip_mass, "the grip's mass");
  require(parts.motor_lag, "the motors' lag");
  require(parts.reel_speed, "the reels' speed");
  commanded_ = motors_ = pulls_ = Tensions::Constant(geometry_.least_tension);
  paid_out_ = way_ = string_lengths(geometry_, grip_.pose);
  measure();
  told_ = counted_;
}

void SimulatedSpidar::command(const Tensions& tensions) {
  if (faults_.silent) return;
  for (int i = 0; i < kStrings; ++i) {
    commanded_[i] =
        std::isfinite(tensions[i]) ? std::clamp(tensions[i], 0.0, geometry_.most_tension) : geometry_.least_tension;
  }
}

void SimulatedSpidar::advance(double h, const Pose& wanted) {
  told_ = counted_;
  if (!(h > 0.0)) return;
  const int steps = std::max(1, static_cast<int>(std::ceil(h / kLongestStep)));
  for (int k = 0; k < steps; ++k) step(h / steps, wanted);
  measure();
}

std::optional<Lengths> SimulatedSpidar::read() const {
  if (faults_.silent) return std::nullopt;
  return told_ + faults_.errors;
}

void SimulatedSpidar::step(double h, const Pose& wanted) {
  pull(h);
  const Wrench wrench = -length_jacobian(geometry_, grip_.pose).transpose() * pulls_;
  move(h, wanted, wrench);
  reel(h);
}

/// A string that is slack pulls nothing; without power the motors let go.
void SimulatedSpidar::pull(double h) {
  const double share = 1.0 - std::exp(-h / parts_.motor_lag);
  for (int i = 0; i < kStrings; ++i) {
    motors_[i] += share * ((faults_.silent ? 0.0 : commanded_[i]) - motors_[i]);
    const double friction = parts_.friction * std::tanh(rates_[i] / kFrictionSpeed);
    const bool powered = faults_.broken_string != i && faults_.dead_motor != i;
    const bool taut = powered && paid_out_[i] - way_[i] < kSlackTolerance;
    pulls_[i] = taut ? std::max(motors_[i] + friction, 0.0) : 0.0;
  }
}

/// The grip draws strings out; the motors take them in.
void SimulatedSpidar::reel(double h) {
  const Lengths way = string_lengths(geometry_, grip_.pose);
  rates_ = (way - way_) / h;
  way_ = way;
  for (int i = 0; i < kStrings; ++i) {
    const double least = faults_.broken_string == i ? 0.0 : way_[i];
    const double taken_in = faults_.dead_motor == i ? 0.0 : h * parts_.reel_speed;
    paid_out_[i] = std::max(least, paid_out_[i] - taken_in);
  }
}

void SimulatedSpidar::move(double h, const Pose& wanted, const Wrench& wrench) {
  const HandModel& hand = parts_.hand;
  const double r2 = hand.radius * hand.radius;
  const Row line{.hand_mass = hand.mass,
                 .grip_mass = parts_.grip_mass,
                 .arm_stiffness = hand.arm_stiffness,
                 .arm_damping = hand.arm_damping,
                 .skin_stiffness = hand.grip_stiffness,
                 .skin_damping = hand.grip_damping};
  const Row turn{.hand_mass = r2 * line.hand_mass,
                 .grip_mass = r2 * line.grip_mass,
                 .arm_stiffness = r2 * line.arm_stiffness,
                 .arm_damping = r2 * line.arm_damping,
                 .skin_stiffness = r2 * line.skin_stiffness,
                 .skin_damping = r2 * line.skin_damping};
  Motion way{.hand = hand_.pose.position - wanted.position,
             .grip = grip_.pose.position - wanted.position,
             .hand_velocity = hand_.velocity,
             .grip_velocity = grip_.velocity};
  const auto beside_wanted = [&](const Body& body) -> Vector3d {
    return math::log_rotation(body.pose.rotation * wanted.rotation.conjugate());
  };
  Motion twist{.hand = beside_wanted(hand_),
               .grip = beside_wanted(grip_),
               .hand_velocity = hand_.spin,
               .grip_velocity = grip_.spin};
  solve(line, h, wrench.head<3>(), way);
  solve(turn, h, wrench.tail<3>(), twist);
  const auto go = [h](Body& body, const Vector3d& velocity, const Vector3d& spin) {
    body.velocity = velocity;
    body.spin = spin;
    body.pose.position += h * velocity;
    body.pose.rotation = (math::exp_rotation(h * spin) * body.pose.rotation).normalized();
  };
  go(hand_, way.hand_velocity, twist.hand_velocity);
  go(grip_, way.grip_velocity, twist.grip_velocity);
  const auto skin = [&](const Row& row, const Vector3d& stretch, const Vector3d& rate) -> Vector3d {
    return row.skin_stiffness * stretch + row.skin_damping * rate;
  };
  felt_.head<3>() = skin(line, grip_.pose.position - hand_.pose.position, grip_.velocity - hand_.velocity);
  felt_.tail<3>() =
      skin(turn, math::log_rotation(grip_.pose.rotation * hand_.pose.rotation.conjugate()), grip_.spin - hand_.spin);
}

void SimulatedSpidar::measure() {
  const double count = geometry_.metres_per_count;
  for (int i = 0; i < kStrings; ++i) {
    if (faults_.frozen || faults_.stuck_encoder == i) continue;
    counted_[i] = std::round(paid_out_[i] / count) * count;
  }
}

}  // namespace layfigure::spidar
