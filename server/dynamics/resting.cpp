#include "resting.h"

#include <bit>
#include <limits>

namespace layfigure::dynamics {
namespace {

/// A hash of numbers, bit by bit.
class Fingerprint {
 public:
  void add(std::uint64_t bits) { hash_ = (hash_ ^ bits) * 0x9e3779b97f4a7c15ULL + (hash_ >> 29); }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(int number) { add(static_cast<std::uint64_t>(number)); }
  template <int kSize>
  void add(const Eigen::Matrix<double, kSize, 1>& numbers) {
    for (const double number : numbers) add(number);
  }
  void add(const Eigen::Quaterniond& rotation) { add(rotation.coeffs()); }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_{0};
};

void add(const Coupling& coupling, Fingerprint& print) {
  print.add(coupling.body);
  print.add(coupling.point);
  print.add(coupling.orientation);
  for (const double number :
       {coupling.stiffness, coupling.damping, coupling.angular_stiffness, coupling.angular_damping}) {
    print.add(number);
  }
  print.add(coupling.target_position);
  print.add(coupling.target_rotation);
  print.add(coupling.target_velocity);
  print.add(coupling.target_angular_velocity);
}

void add(const Tie& tie, Fingerprint& print) {
  print.add(tie.body_a);
  print.add(tie.body_b);
  print.add(tie.point_a);
  print.add(tie.point_b);
  for (const double number : {tie.stiffness, tie.damping, tie.max_force, tie.holds_rotation ? 1.0 : 0.0,
                              tie.angular_stiffness, tie.angular_damping, tie.max_torque}) {
    print.add(number);
  }
  print.add(tie.rotation);
}

void add(const Drive& drive, Fingerprint& print) {
  print.add(drive.body);
  for (const double number : {drive.stiffness, drive.damping, drive.max_torque}) print.add(number);
  print.add(drive.target_rotation);
  print.add(drive.target_velocity);
}

void add(const Contact& contact, Fingerprint& print) {
  print.add(contact.body_a);
  print.add(contact.body_b);
  print.add(contact.point_a);
  print.add(contact.point_b);
  print.add(contact.normal);
  print.add(contact.friction);
  print.add(contact.surface_velocity);
}

/// Of all that acts on the doll beside contacts, softness among it.
std::uint64_t print_of(const Inputs& inputs, std::span<const BodyForce> loads, const State& state) {
  Fingerprint print;
  for (const Coupling& coupling : inputs.couplings) add(coupling, print);
  for (const Tie& tie : inputs.ties) add(tie, print);
  for (const Drive& drive : inputs.drives) add(drive, print);
  for (std::size_t i = 0; i < loads.size(); ++i) {
    print.add(loads[i].force);
    print.add(loads[i].torque);
  }
  for (const BodyState& body : state.bodies) print.add(body.yield_scale);
  return print.value();
}

/// Which contacts there are.
std::uint64_t names_of(std::span<const Contact> contacts) {
  Fingerprint print;
  for (const Contact& contact : contacts) {
    print.add(contact.body_a);
    print.add(contact.body_b);
    print.add(contact.key);
  }
  return print.value();
}

std::uint64_t print_of(std::span<const Contact> contacts) {
  Fingerprint print;
  for (const Contact& contact : contacts) add(contact, print);
  return print.value();
}

}  // namespace

void rest_if_undisturbed(const Inputs& inputs, std::span<const BodyForce> loads, State& state) {
  const std::uint64_t print = print_of(inputs, loads, state);
  const bool undisturbed = state.rest.inputs == print;
  state.rest = {
      .resting = undisturbed, .knows_contacts = false, .inputs = print, .contacts = names_of(inputs.contacts)};
  if (!undisturbed) return;
  for (BodyState& body : state.bodies) {
    body.linear_momentum.setZero();
    body.angular_momentum.setZero();
  }
}

bool keeps_resting(const Inputs& inputs, std::span<const BodyForce> loads, State& state) {
  if (!state.rest.resting) return false;
  const std::uint64_t contacts = state.rest.knows_contacts ? print_of(inputs.contacts) : names_of(inputs.contacts);
  if (state.rest.inputs != print_of(inputs, loads, state) || state.rest.contacts != contacts) {
    state.rest = {};
    return false;
  }
  // The last step moved the doll a little: the same contacts are where they will stay only now.
  if (!state.rest.knows_contacts) {
    state.rest.knows_contacts = true;
    state.rest.contacts = print_of(inputs.contacts);
  }
  return true;
}

}  // namespace layfigure::dynamics
