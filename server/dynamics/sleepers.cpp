#include "sleepers.h"

#include <algorithm>
#include <cmath>

#include "axis_law.h"
#include "layfigure/dynamics/step.h"

namespace layfigure::dynamics {
namespace {

// A joint at its yield torque would flow under any more: this part of the torque that bends it by the sleep angle is
// none. What flows until it is carried is the same part of the angle.
constexpr double kFlowShare = 1e-3;

// Part of the sleep angle that what falls asleep may still be from rest: the pose that it sleeps in is to be the one
// that it would come to. Settling takes five time constants more for it, which a doll's joints have while a person
// pauses.
constexpr double kStillShare = 1e-2;

// Parts of what a transmitting joint's torque leaves to its tolerance: what its group's motion may take of it, and what
// is left to it for certain, whatever rounding does.
constexpr double kMovingShare = 0.25;
constexpr double kSurely = 0.99;

bool acts(const BodyForce& load) { return !load.force.isZero(0.0) || !load.torque.isZero(0.0); }

double yield_torque(const JointLaw& law, const BodyState& body) {
  if (!std::isfinite(law.yield_torque)) return law.yield_torque;
  return (law.yield_torque + law.hardening * body.flow) * body.yield_scale;
}

/// n(t)
double torque_norm(const JointLaw& law, const Eigen::Vector3d& torque_B) {
  const Eigen::Vector3d t = law.shape.axes.conjugate() * torque_B;
  return std::sqrt(t.cwiseAbs2().dot(axis_inverse_shape(law)));
}

/// Each body with all that hangs on it, in its frame, in the definition's pose.
std::vector<Composite> all_behind(const Model& model) {
  std::vector<Composite> behind;
  for (int i = 0; i < model.size(); ++i) {
    const BodyDefinition& body = model.body(i);
    behind.push_back({.mass = body.mass, .com = body.com, .inertia = body.inertia});
  }
  for (int i = model.size() - 1; i > 0; --i) {
    const BodyDefinition& body = model.body(i);
    if (body.parent >= 0) behind[body.parent].add(turned(behind[i], body.rotation, body.anchor));
  }
  return behind;
}

/// About the frame's origin; a bound that is off by little for what is long.
double largest_moment(const Composite& composite) {
  return composite.inertia.diagonal().maxCoeff() + composite.mass * composite.com.squaredNorm();
}

}  // namespace

Sleepers::Sleepers(const Model& model)
    : wanted_(model.size()),
      touched_(model.size()),
      motions_(model.size()),
      calm_(model.size()),
      steady_(model.size()),
      anew_(model.size()),
      seen_(model.size()) {
  const std::vector<Composite> behind = all_behind(model);
  std::vector<double> reach(model.size());
  for (int i = 0; i < model.size(); ++i) {
    const BodyDefinition& body = model.body(i);
    joints_.push_back(joint_of(body.joint, largest_moment(behind[i])));
    if (body.parent < 0 && model.root() != RootKind::kBall) {
      joints_.back().settling = joints_.back().flow_settling = kDwell;
    }
    reach[i] = body.parent < 0 ? 0.0 : reach[body.parent] + body.anchor.norm();
    reach_ = std::max(reach_, reach[i] + body.com.norm() + std::sqrt(body.inertia.trace() / body.mass));
  }
}

Sleepers::Joint Sleepers::joint_of(const JointLaw& law, double moment) {
  const Eigen::Vector3d K = axis_stiffness(law);
  const Eigen::Vector3d D = axis_damping(law);
  Joint joint{.settling = 0.0,
              .flow_settling = 0.0,
              .stiffness = kRigidStiffness,
              .smallest_ratio = JointLimits::kInfinity,
              .welded = is_welded(law)};
  for (int axis = 0; axis < 3; ++axis) {
    if (law.shape.locked[axis]) continue;
    joint.settling = std::max({joint.settling, D[axis] / K[axis], std::sqrt(moment / K[axis])});
    joint.flow_settling = std::max({joint.flow_settling, joint.settling, (D[axis] + law.flow_damping) / K[axis]});
    joint.stiffness = std::min(joint.stiffness, K[axis]);
    joint.smallest_ratio = std::min(joint.smallest_ratio, law.shape.yield[axis]);
  }
  return joint;
}

void Sleepers::start_from(const State& state) {
  for (std::size_t i = 0; i < wanted_.size(); ++i) wanted_[i] = state.bodies[i].asleep ? 1 : 0;
}

bool Sleepers::differs_from(const State& state) const {
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    if ((wanted_[i] != 0) != state.bodies[i].asleep) return true;
  }
  return false;
}

bool Sleepers::wake_all(const State& state) {
  for (std::size_t i = 0; i < wanted_.size(); ++i) wanted_[i] = state.bodies[i].asleep && joints_[i].welded ? 1 : 0;
  return differs_from(state);
}

/// Marks the way from a body that something acts on to its root.
void Sleepers::touch(const Model& model, const State& state, int body) {
  for (; body >= 0 && touched_[body] == 0; body = model.body(body).parent) {
    touched_[body] = 1;
    touches_sleepers_ = touches_sleepers_ || (state.bodies[body].asleep && !joints_[body].welded);
  }
}

bool Sleepers::wake_touched(const Model& model, const State& state, const Inputs& inputs,
                            std::span<const BodyForce> loads) {
  std::fill(touched_.begin(), touched_.end(), 0);
  touches_sleepers_ = false;
  for (const Contact& contact : inputs.contacts) {
    touch(model, state, contact.body_a);
    touch(model, state, contact.body_b);
  }
  for (const Tie& tie : inputs.ties) {
    touch(model, state, tie.body_a);
    touch(model, state, tie.body_b);
  }
  for (const Drive& drive : inputs.drives) touch(model, state, drive.body);
  for (std::size_t i = 0; i < loads.size(); ++i) {
    if (acts(loads[i])) touch(model, state, static_cast<int>(i));
  }
  if (!touches_sleepers_) return false;
  start_from(state);
  for (std::size_t i = 0; i < touched_.size(); ++i) {
    if (touched_[i] != 0 && !joints_[i].welded) wanted_[i] = 0;
  }
  return true;
}

void Sleepers::observe(const Model& model, const RigidGroup& group, int carrier, const Transmission::Step& step) {
  const BodyState& before = step.before[carrier];
  const BodyState& after = step.after[carrier];
  const Eigen::Quaterniond R_CW = step.orientations[carrier].conjugate();
  const Eigen::Vector3d momentum = R_CW * after.angular_momentum;
  const Eigen::Vector3d spin = spin_of(group.inertia, momentum);
  const Eigen::Vector3d torque = R_CW * (after.angular_momentum - before.angular_momentum) / step.h;
  const Eigen::Vector3d acceleration = (after.linear_momentum - before.linear_momentum) / (step.h * group.mass);
  motions_[carrier] = {.specific_force = R_CW * (acceleration - model.gravity()),
                       .acceleration = spin_of(group.inertia, torque - spin.cross(momentum)),
                       .spin = spin,
                       .R_CW = R_CW,
                       .matters = true};
}

bool Sleepers::is_calm(const Calm& calm, int carrier, int version) const {
  if (calm.version != version) return false;
  const Motion& motion = motions_[carrier];
  const double spins = motion.spin.squaredNorm() + calm.motion.spin.squaredNorm();
  return calm.force_gain * (motion.specific_force - calm.motion.specific_force).norm() +
             calm.spin_gain * ((motion.acceleration - calm.motion.acceleration).norm() + spins) <=
         1.0;
}

/// Change of the joint's torque that neither bends it by the angle nor makes it yield [N m]; negative if it yields as
/// it is.
double Sleepers::tolerance(const Model& model, const BodyState& body, int index, double angle) const {
  const JointLaw& law = model.body(index).joint;
  const double bending = joints_[index].stiffness * angle;
  const double yield = yield_torque(law, body);
  if (!std::isfinite(yield)) return bending;
  const double room = (yield - torque_norm(law, body.torque)) * joints_[index].smallest_ratio;
  const double none = kFlowShare * bending;
  return room < -none ? -1.0 : std::min(bending, std::max(room, none));
}

/// What the torque of the rider's joint leaves to its tolerance; negative if the joint does not stay as it is.
double Sleepers::margin(const Rider& rider, const RigidGroup& group, double tolerance,
                        const Transmission& transmission) const {
  const Motion& motion = motions_[rider.carrier];
  const Composite& behind = rider.behind;
  const Eigen::Vector3d& w = motion.spin;
  const Eigen::Vector3d lever = behind.com - rider.origin;
  const Eigen::Vector3d d = behind.com - group.com;
  const Eigen::Vector3d force = motion.specific_force + motion.acceleration.cross(d) + w.cross(w.cross(d));
  Eigen::Vector3d needed =
      lever.cross(behind.mass * force) + behind.inertia * motion.acceleration + w.cross(behind.inertia * w);
  if (transmission.transmits(rider.body)) needed += transmission.moment(rider.body);
  return tolerance - (needed + rider.rotation * rider.torque).norm();
}

/// The group's calm is at most that of the rider.
void Sleepers::narrow_calm(const Rider& rider, const RigidGroup& group, double margin, Calm& calm) {
  const Composite& behind = rider.behind;
  const double moment = behind.mass * (behind.com - rider.origin).norm();
  calm.force_gain = std::max(calm.force_gain, moment / margin);
  calm.spin_gain =
      std::max(calm.spin_gain, (moment * (behind.com - group.com).norm() + behind.inertia.trace()) / margin);
}

/// Takes note of the groups whose motion shows that none of their riders' torques can matter.
bool Sleepers::find_calm(const RigidGroups& groups) {
  bool all_calm = true;
  for (const int carrier : groups.carriers()) {
    if (groups.group(carrier).riders == 0) continue;
    motions_[carrier].matters = !is_calm(calm_[carrier], carrier, groups.version());
    if (!motions_[carrier].matters) continue;
    calm_[carrier] = {.version = groups.version(), .motion = motions_[carrier], .force_gain = 0.0, .spin_gain = 0.0};
    all_calm = false;
  }
  return all_calm;
}

void Sleepers::forget_calm_of_others(const Transmission& transmission) {
  if (transmission.version() == left_out_) return;
  left_out_ = transmission.version();
  for (Calm& calm : calm_) calm.version = kForgotten;
}

/// Which groups still move, and transmit through the same riders, as when these were last looked at.
void Sleepers::find_steady(const RigidGroups& groups, const Transmission& transmission, double angle) {
  const bool same = angle == seen_angle_;
  seen_angle_ = angle;
  for (const int carrier : groups.carriers()) {
    if (groups.group(carrier).riders == 0) continue;
    anew_[carrier] = same && is_calm(steady_[carrier], carrier, transmission.version()) ? 0 : 1;
    if (anew_[carrier] == 0) continue;
    steady_[carrier] = {
        .version = transmission.version(), .motion = motions_[carrier], .force_gain = 0.0, .spin_gain = 0.0};
  }
}

bool Sleepers::stays(int rider, int carrier, const Transmission& transmission) const {
  const Seen& seen = seen_[rider];
  return anew_[carrier] == 0 && (transmission.moment(rider) - seen.moment).squaredNorm() < seen.most;
}

/// The motions of now and of later are each within the group's calm, so twice its part may be gone.
void Sleepers::see(const Rider& rider, const RigidGroup& group, double margin, const Transmission& transmission) {
  Seen& seen = seen_[rider.body];
  if (anew_[rider.carrier] != 0) {
    seen.moving = kMovingShare * margin;
    narrow_calm(rider, group, seen.moving, steady_[rider.carrier]);
  }
  const double rest = std::max(kSurely * margin - 2.0 * seen.moving, 0.0);
  seen.moment = transmission.moment(rider.body);
  seen.most = rest * rest;
}

bool Sleepers::wake_overloaded(const Model& model, const State& state, double angle, const RigidGroups& groups,
                               const Transmission& transmission) {
  forget_calm_of_others(transmission);
  const bool calm = find_calm(groups);
  bool some_wake = false;
  const auto look_at = [&](const Rider& rider) {
    if (joints_[rider.body].welded) return;
    const RigidGroup& group = groups.group(rider.carrier);
    const double most = tolerance(model, state.bodies[rider.body], rider.body, angle);
    const double left = margin(rider, group, most, transmission);
    if (!(left > 0.0)) {
      if (!some_wake) start_from(state);
      some_wake = true;
      wanted_[rider.body] = 0;
    } else if (transmission.transmits(rider.body)) {
      see(rider, group, left, transmission);
    } else {
      narrow_calm(rider, group, left, calm_[rider.carrier]);
    }
  };
  if (!transmission.transmitting().empty()) find_steady(groups, transmission, angle);
  for (const int body : transmission.transmitting()) {
    const Rider& rider = groups.rider(body);
    if (!stays(body, rider.carrier, transmission)) look_at(rider);
  }
  // What a pull does to bodies that hang on a joint which gives way to it is seen once that is awake.
  if (some_wake || calm) return some_wake;
  for (const Rider& rider : groups.riders()) {
    if (motions_[rider.carrier].matters && !transmission.transmits(rider.body)) look_at(rider);
  }
  return some_wake;
}

bool Sleepers::let_sleep(const Model& model, const State& state) {
  if (!some_ripe_) return false;
  start_from(state);
  for (int i = 0; i < model.size(); ++i) {
    const BodyState& body = state.bodies[i];
    // At its limits a joint is held by more than its torque.
    const bool free = !model.body(i).limits.any() || body.limit_slack > 0.0;
    if (model.body(i).parent >= 0 && body.rest_time >= kDwell && touched_[i] == 0 && free) wanted_[i] = 1;
  }
  return differs_from(state);
}

/// Compared by squares; the turn by the chord between the quaternions, which is half the angle.
bool Sleepers::is_still(int index, const BodyState& before, const BodyState& after, double h, double angle) const {
  const Joint& joint = joints_[index];
  const double settling = after.yielding ? joint.flow_settling : joint.settling;
  const double most = kStillShare * angle * h;
  const double chord2 = (after.rotation.coeffs() - before.rotation.coeffs()).squaredNorm();
  if (!(4.0 * chord2 * settling * settling <= most * most)) return false;
  return (after.position - before.position).norm() * kDwell <= reach_ * most;
}

void Sleepers::count_rest(const Model& model, const std::vector<BodyState>& before, double h, double angle,
                          const std::vector<int>& carriers, std::vector<BodyState>& after) {
  all_still_ = true;
  some_ripe_ = false;
  for (const int i : carriers) {
    BodyState& body = after[i];
    body.rest_time = is_still(i, before[i], body, h, angle) ? before[i].rest_time + h : 0.0;
    const bool ripe = body.rest_time >= kDwell;
    all_still_ = all_still_ && ripe;
    some_ripe_ = some_ripe_ || (ripe && touched_[i] == 0 && model.body(i).parent >= 0);
  }
}

}  // namespace layfigure::dynamics
