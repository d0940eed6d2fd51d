#include "group_inputs.h"

namespace layfigure::dynamics {
namespace {

/// A body's frame in that of its group's carrier; the world's is its own.
struct Place {
  int carrier;
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};
  Eigen::Vector3d origin{Eigen::Vector3d::Zero()};

  [[nodiscard]] Eigen::Vector3d of(const Eigen::Vector3d& point) const { return origin + rotation * point; }
};

Place place_of(const RigidGroups& groups, int body) {
  if (body < 0 || !groups.rides(body)) return {.carrier = body};
  const Rider& rider = groups.rider(body);
  return {.carrier = rider.carrier, .rotation = rider.rotation, .origin = rider.origin};
}

Coupling mapped(Coupling coupling, const RigidGroups& groups) {
  const Place place = place_of(groups, coupling.body);
  coupling.body = place.carrier;
  coupling.point = place.of(coupling.point);
  coupling.orientation = place.rotation * coupling.orientation;
  return coupling;
}

/// Contacts and ties.
template <class Pair>
Pair mapped_pair(Pair pair, const RigidGroups& groups) {
  const Place a = place_of(groups, pair.body_a);
  const Place b = place_of(groups, pair.body_b);
  pair.body_a = a.carrier;
  pair.body_b = b.carrier;
  pair.point_a = a.of(pair.point_a);
  pair.point_b = b.of(pair.point_b);
  return pair;
}

Tie mapped(const Tie& tie, const RigidGroups& groups) {
  Tie result = mapped_pair(tie, groups);
  const Place a = place_of(groups, tie.body_a);
  const Place b = place_of(groups, tie.body_b);
  result.rotation = b.rotation * tie.rotation * a.rotation.conjugate();
  return result;
}

Drive mapped(const Drive& drive, const RigidGroups& groups) {
  return groups.rides(drive.body) ? Drive{.body = groups.carrier_of(drive.body)} : drive;
}

void shift_load(const BodyForce& load, const Eigen::Vector3d& lever, BodyForce& group) {
  group.force += load.force;
  group.torque += load.torque + lever.cross(load.force);
}

}  // namespace

void GroupInputs::reserve(const Inputs& inputs) {
  couplings_.reserve(inputs.couplings.size());
  contacts_.reserve(inputs.contacts.size());
  ties_.reserve(inputs.ties.size());
  drives_.reserve(inputs.drives.size());
}

const Inputs& GroupInputs::map(const Inputs& inputs, const RigidGroups& groups) {
  if (groups.riders().empty()) return inputs;
  couplings_.clear();
  contacts_.clear();
  ties_.clear();
  drives_.clear();
  for (const Coupling& coupling : inputs.couplings) couplings_.push_back(mapped(coupling, groups));
  for (const Contact& contact : inputs.contacts) contacts_.push_back(mapped_pair(contact, groups));
  for (const Tie& tie : inputs.ties) ties_.push_back(mapped(tie, groups));
  for (const Drive& drive : inputs.drives) drives_.push_back(mapped(drive, groups));
  mapped_ = {.loads = inputs.loads, .couplings = couplings_, .contacts = contacts_, .ties = ties_, .drives = drives_};
  return mapped_;
}

void carry_loads(const RigidGroups& groups, Copy& copy) {
  if (groups.riders().empty()) return;
  for (const int carrier : groups.carriers()) {
    const RigidGroup& group = groups.group(carrier);
    BodyForce& load = copy.loads[carrier];
    if (group.riders == 0 || load.force.isZero(0.0)) continue;
    load.torque += (groups.orientation(copy.from, carrier) * group.lever).cross(load.force);
  }
  for (const Rider& rider : groups.riders()) {
    const BodyForce& load = copy.loads[rider.body];
    if (load.force.isZero(0.0) && load.torque.isZero(0.0)) continue;
    shift_load(load, groups.orientation(copy.from, rider.carrier) * rider.lever, copy.loads[rider.carrier]);
  }
}

}  // namespace layfigure::dynamics
