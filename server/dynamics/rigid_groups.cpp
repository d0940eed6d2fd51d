#include "rigid_groups.h"

#include "layfigure/math/kernel.h"
#include "schedule.h"

namespace layfigure::dynamics {
namespace {

constexpr int kCarrier = -1;

bool holds_momentum(const BodyState& body) {
  const Eigen::Vector3d& p = body.linear_momentum;
  const Eigen::Vector3d& L = body.angular_momentum;
  return p.x() != 0.0 || p.y() != 0.0 || p.z() != 0.0 || L.x() != 0.0 || L.y() != 0.0 || L.z() != 0.0;
}

math::Lanes4 pack(const double* numbers) {
  return math::from_lanes<math::Lanes4>([&](int k) { return numbers[k]; });
}

Still still(const BodyState& body, int index) {
  return {.body = index,
          .rotation = pack(body.rotation.coeffs().data()),
          .angular = math::Lanes4(math::Lanes4::Vector{0.0, 0.0, 0.0, body.yield_scale})};
}

/// Each of them sleeps, as it was, bit by bit.
LAYFIGURE_KERNEL
bool are_still(const BodyState* bodies, const Still* sleepers, std::size_t count) {
  using Bits = math::Mask4::Vector;
  const auto bits = [](const double* numbers) { return Bits(math::load(numbers).v); };
  // Not the flow behind the linear momentum, which matters to nothing that sleeps.
  const Bits momentum{-1, -1, -1, 0};
  Bits changed{};
  bool asleep = true;
  for (const Still* was = sleepers; was != sleepers + count; ++was) {
    const BodyState& body = bodies[was->body];
    changed |= bits(body.rotation.coeffs().data()) ^ Bits(was->rotation.v);
    changed |= bits(body.linear_momentum.data()) & momentum;
    changed |= bits(body.angular_momentum.data()) ^ Bits(was->angular.v);
    asleep &= body.asleep;
  }
  return asleep && (changed[0] | changed[1] | changed[2] | changed[3]) == 0;
}

/// Momenta of a part, in the group's frame, of a group that moves as a whole.
void set_momenta(const Composite& part, const Eigen::Vector3d& group_com, const GroupMotion& motion, BodyState& body) {
  const Eigen::Matrix3d R_WC = motion.orientation.toRotationMatrix();
  const Eigen::Vector3d r = R_WC * (part.com - group_com);
  body.linear_momentum = part.mass * (motion.velocity + motion.spin.cross(r));
  body.angular_momentum = R_WC * (part.inertia * (R_WC.transpose() * motion.spin));
}

}  // namespace

Composite turned(const Composite& composite, const Eigen::Quaterniond& rotation, const Eigen::Vector3d& origin) {
  const Eigen::Matrix3d R = rotation.toRotationMatrix();
  return {.mass = composite.mass, .com = origin + R * composite.com, .inertia = R * composite.inertia * R.transpose()};
}

void Composite::add(const Composite& other) {
  const double total = mass + other.mass;
  const Eigen::Vector3d d = other.com - com;
  inertia += other.inertia;
  inertia += mass * other.mass / total * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  com += other.mass / total * d;
  mass = total;
}

RigidGroup idle_group() {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  return {.parent = -1,
          .anchor = zero,
          .mount = Eigen::Quaterniond::Identity(),
          .mounted = false,
          .mass = 1.0,
          .com = zero,
          .inertia = {.moments = Eigen::Vector3d::Ones(), .axes = Eigen::Matrix3d::Identity()},
          .lever = zero,
          .riders = 0};
}

RigidGroups::RigidGroups(const Model& model) {
  const int n = model.size();
  for (int i = 0; i < n; ++i) {
    const BodyDefinition& body = model.body(i);
    principal_.push_back(principal_inertia(body.mass, body.inertia));
    own_.push_back({.mass = body.mass, .com = body.com, .inertia = inertia_matrix(principal_.back())});
  }
  parents_.reserve(n);
  carriers_.reserve(n);
  riders_.reserve(n);
  still_.reserve(n);
  rider_of_.resize(n);
  groups_.resize(n);
  sums_ = own_;
  motions_.resize(n);
  State awake = initial_state(model);
  for (BodyState& body : awake.bodies) body.asleep = false;
  group(model, awake);
}

bool RigidGroups::describes(const State& state) const {
  for (const int carrier : carriers_) {
    if (state.bodies[carrier].asleep) return false;
  }
  return are_still(state.bodies.data(), still_.data(), still_.size());
}

void RigidGroups::assign(const Model& model, State& state) {
  group(model, state);
  for (const Rider& rider : riders_) {
    if (holds_momentum(state.bodies[rider.body])) {
      hand_over(rider, orientation(state.bodies.data(), rider.carrier), state);
    }
  }
}

void RigidGroups::regroup(const Model& model, State& state, const std::vector<char>& asleep) {
  spread_momenta(state);
  for (std::size_t i = 0; i < asleep.size(); ++i) state.bodies[i].asleep = asleep[i] != 0;
  group(model, state);
  unite_momenta(state);
}

void RigidGroups::group(const Model& model, const State& state) {
  parents_.clear();
  carriers_.clear();
  riders_.clear();
  still_.clear();
  for (int i = 0; i < model.size(); ++i) place(model, state, i);
  sum_up(model);
  ++version_;
}

void RigidGroups::place(const Model& model, const State& state, int index) {
  const BodyDefinition& body = model.body(index);
  const BodyState& now = state.bodies[index];
  const bool jointed = body.parent >= 0;
  const Rider* above = jointed && rides(body.parent) ? &rider(body.parent) : nullptr;
  const int carrier = above != nullptr ? above->carrier : body.parent;
  const Eigen::Quaterniond mount = above != nullptr ? above->rotation : Eigen::Quaterniond::Identity();
  const Eigen::Vector3d anchor = above != nullptr ? Eigen::Vector3d(above->origin + mount * body.anchor) : body.anchor;
  if (jointed && now.asleep) {
    rider_of_[index] = static_cast<int>(riders_.size());
    parents_.push_back(Schedule::kAbsent);
    riders_.push_back({.body = index,
                       .carrier = carrier,
                       .rotation = (mount * now.rotation).normalized(),
                       .origin = anchor,
                       .lever = Eigen::Vector3d::Zero(),
                       .behind = {},
                       .joint_rotation = now.rotation,
                       .torque = now.torque,
                       .yield_scale = now.yield_scale});
    still_.push_back(still(now, index));
    return;
  }
  rider_of_[index] = kCarrier;
  carriers_.push_back(index);
  parents_.push_back(carrier);
  groups_[index] = {.parent = carrier,
                    .anchor = jointed ? anchor : Eigen::Vector3d::Zero(),
                    .mount = mount,
                    .mounted = above != nullptr,
                    .mass = body.mass,
                    .com = body.com,
                    .inertia = principal_[index],
                    .lever = Eigen::Vector3d::Zero(),
                    .riders = 0};
}

/// Sums what hangs on each rider, and each group, from the leaves on.
void RigidGroups::sum_up(const Model& model) {
  for (const int carrier : carriers_) sums_[carrier] = own_[carrier];
  for (const Rider& rider : riders_) sums_[rider.body] = turned(own_[rider.body], rider.rotation, rider.origin);
  for (auto rider = riders_.rbegin(); rider != riders_.rend(); ++rider) {
    rider->behind = sums_[rider->body];
    sums_[model.body(rider->body).parent].add(rider->behind);
    ++groups_[rider->carrier].riders;
  }
  for (const int carrier : carriers_) {
    RigidGroup& group = groups_[carrier];
    if (group.riders == 0) continue;
    const Composite& sum = sums_[carrier];
    group.mass = sum.mass;
    group.com = sum.com;
    group.inertia = principal_inertia(sum.mass, sum.inertia);
    group.lever = own_[carrier].com - sum.com;
  }
  for (Rider& rider : riders_) rider.lever = part(rider).com - groups_[rider.carrier].com;
}

Composite RigidGroups::part(const Rider& rider) const { return turned(own_[rider.body], rider.rotation, rider.origin); }

Eigen::Quaterniond RigidGroups::orientation(const BodyState* bodies, int carrier) const {
  Eigen::Quaterniond rotation = bodies[carrier].rotation;
  for (const RigidGroup* group = &groups_[carrier]; group->parent >= 0; group = &groups_[group->parent]) {
    const Eigen::Quaterniond& above = bodies[group->parent].rotation;
    rotation = group->mounted ? above * (group->mount * rotation) : above * rotation;
  }
  return rotation.normalized();
}

GroupMotion RigidGroups::motion(const BodyState* bodies, int carrier) const {
  const RigidGroup& group = groups_[carrier];
  const BodyState& body = bodies[carrier];
  const Eigen::Quaterniond R_WC = orientation(bodies, carrier);
  return {.orientation = R_WC,
          .spin = R_WC * spin_of(group.inertia, R_WC.conjugate() * body.angular_momentum),
          .velocity = body.linear_momentum / group.mass};
}

void RigidGroups::spread_momenta(State& state) {
  for (const int carrier : carriers_) {
    const RigidGroup& group = groups_[carrier];
    if (group.riders == 0) continue;
    motions_[carrier] = motion(state.bodies.data(), carrier);
    set_momenta(own_[carrier], group.com, motions_[carrier], state.bodies[carrier]);
  }
  for (const Rider& rider : riders_) {
    set_momenta(part(rider), groups_[rider.carrier].com, motions_[rider.carrier], state.bodies[rider.body]);
  }
}

void RigidGroups::unite_momenta(State& state) {
  for (const int carrier : carriers_) {
    const RigidGroup& group = groups_[carrier];
    if (group.riders == 0) continue;
    BodyState& body = state.bodies[carrier];
    motions_[carrier].orientation = orientation(state.bodies.data(), carrier);
    const Eigen::Vector3d r = motions_[carrier].orientation * group.lever;
    body.angular_momentum += r.cross(body.linear_momentum);
  }
  for (const Rider& rider : riders_) hand_over(rider, motions_[rider.carrier].orientation, state);
}

/// A rider's momenta become a part of its carrier's.
void RigidGroups::hand_over(const Rider& rider, const Eigen::Quaterniond& R_WC, State& state) const {
  BodyState& body = state.bodies[rider.body];
  BodyState& carrier = state.bodies[rider.carrier];
  const Eigen::Vector3d r = R_WC * rider.lever;
  carrier.linear_momentum += body.linear_momentum;
  carrier.angular_momentum += body.angular_momentum + r.cross(body.linear_momentum);
  body.linear_momentum.setZero();
  body.angular_momentum.setZero();
}

}  // namespace layfigure::dynamics
