#include "layfigure/haptics/local_dynamics.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "layfigure/dynamics/constraints.h"
#include "layfigure/math/rotation.h"

namespace layfigure::haptics {
namespace {

using Eigen::Vector3d;
using ConstRows = Eigen::Map<const Eigen::VectorXd>;
using ConstMatrix = Eigen::Map<const Eigen::MatrixXd>;

Vector3d stored_position(const LocalModel& model, int port) { return Vector3d(model.position.data() + 3 * port); }
Eigen::Quaterniond stored_rotation(const LocalModel& model, int port) {
  return Eigen::Quaterniond(model.rotation.data() + 4 * port);
}

/// [turn; way] from one pose to another, world.
Eigen::Matrix<double, 6, 1> between(const Vector3d& p, const Eigen::Quaterniond& R, const Vector3d& p_to,
                                    const Eigen::Quaterniond& R_to) {
  Eigen::Matrix<double, 6, 1> way;
  way << math::log_rotation(R_to * R.conjugate()), p_to - p;
  return way;
}

// Of lost_by_step(), for what is of third order in the step.
constexpr double kSureLoss = 0.5;

int same_port(const LocalModel& model, const LocalModel& other, int port) {
  for (int i = 0; i < other.ports; ++i) {
    const bool same_point =
        std::equal(model.point.begin() + 3 * port, model.point.begin() + 3 * port + 3, other.point.begin() + 3 * i);
    if (same_point && other.body[i] == model.body[port] && other.own[i] == model.own[port]) return i;
  }
  return -1;
}

/// |dv|_M^2 / 2 of the step of physics from `before` to `after`, see the header. Zero where a port has gone.
double lost_by_step(const LocalModel& before, const LocalModel& after) {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostPortRows, 1> change, momentum;
  change.setZero(before.rows());
  for (int k = 0; k < before.ports; ++k) {
    if (before.own[k]) continue;
    const int same = same_port(before, after, k);
    if (same < 0) return 0.0;
    for (int i = 0; i < 6; ++i) change[6 * k + i] = after.velocity[6 * same + i] - before.velocity[6 * k + i];
  }
  momentum.resize(before.rows());
  momentum.noalias() = ConstMatrix(before.mass.data(), before.rows(), before.rows()) * change;
  return 0.5 * change.dot(momentum);
}

}  // namespace

LocalDynamics::LocalDynamics() {
  laws_.resize(kMostContactRows);
  lcp_.reserve(kMostContactRows);
  impulses_.setZero(0);
}

LocalDynamics::Layout LocalDynamics::layout() const noexcept {
  Layout layout{.pointers = model_.pointers,
                .ports = model_.ports,
                .pointer = model_.pointer,
                .body = model_.body,
                .own = model_.own,
                .point = model_.point,
                .velocity = {}};
  for (int k = 0; k < model_.ports; ++k) layout.velocity[k] = velocity(k);
  return layout;
}

/// The port's index in the last model, -1: it is new.
int LocalDynamics::port_before(int port, const Layout& before) const noexcept {
  const bool held = port < model_.pointers;
  const int first = held ? 0 : before.pointers;
  const int end = held ? before.pointers : before.ports;
  for (int i = first; i < end; ++i) {
    if (before.body[i] != model_.body[port]) continue;
    if (!held) return i;
    const bool same_point =
        std::equal(before.point.begin() + 3 * i, before.point.begin() + 3 * i + 3, model_.point.begin() + 3 * port);
    if (before.pointer[i] == model_.pointer[port] && same_point) return i;
  }
  return -1;
}

/// What physics was done with the last interval's mean wrenches.
void LocalDynamics::account_physics(const Layout& before) noexcept {
  const std::array<Interval, kMostPorts> old = intervals_;
  double work = 0.0;
  int found = 0;
  for (int k = 0; k < model_.ports; ++k) {
    Interval& interval = intervals_[k];
    const int same = port_before(k, before);
    interval = same < 0 ? Interval{} : old[same];
    found += same < 0 ? 0 : 1;
    const Vector3d position = stored_position(model_, k);
    const Eigen::Quaterniond rotation = stored_rotation(model_, k);
    if (pending_ && same >= 0 && !before.own[same]) {
      work += interval.mean.dot(between(interval.physics_position, interval.physics_rotation, position, rotation));
    }
    interval.physics_position = position;
    interval.physics_rotation = rotation;
  }
  if (pending_) ledger_.energy += found == before.ports ? given_ - work : std::min(given_ - work, 0.0);
  pending_ = false;
}

/// Ports go on from where they are; new ones are where physics has them.
void LocalDynamics::take_ports(const Layout& before) noexcept {
  const std::array<PortState, kMostPorts> old = ports_;
  for (int k = 0; k < model_.ports; ++k) {
    PortState& port = ports_[k];
    const Vector3d position = stored_position(model_, k);
    const Eigen::Quaterniond rotation = stored_rotation(model_, k);
    const int same = port_before(k, before);
    port = same < 0 ? PortState{.position = position, .rotation = rotation, .offset = Vector6::Zero()} : old[same];
    port.offset = between(port.position, port.rotation, position, rotation);
  }
}

/// The doll's ports are as fast as physics has them; a pointer's own body goes on.
void LocalDynamics::keep_speeds(const Layout& before) noexcept {
  speed_.setZero(model_.rows());
  const ConstRows velocity(model_.velocity.data(), model_.rows());
  for (int k = 0; k < model_.pointers; ++k) {
    const int same = port_before(k, before);
    if (!model_.own[k] || same < 0) continue;
    speed_.segment<3>(6 * k) = before.velocity[same].angular - velocity.segment<3>(6 * k);
    speed_.segment<3>(6 * k + 3) = before.velocity[same].linear - velocity.segment<3>(6 * k + 3);
  }
}

void LocalDynamics::hand_over(const LocalModel& model) noexcept {
  const Layout before = layout();
  const double lost = pending_ ? kSureLoss * lost_by_step(model_, model) : 0.0;
  model_ = model;
  has_model_ = true;
  account_physics(before);
  const double booked = std::clamp(-ledger_.energy, 0.0, lost);
  ledger_.energy += booked;
  ledger_.lost += booked;
  ledger_.lowest = std::min(ledger_.lowest, ledger_.energy);
  take_ports(before);
  way_.setZero(model_.rows());
  keep_speeds(before);
  pull_.setZero(model_.rows());
  wrench_.setZero(model_.rows());
  impulses_.setZero(3 * model_.contacts);
  for (int i = 0; i < model_.contacts; ++i) {
    laws_[3 * i] = dynamics::LcpRow::contact(model_.contact[i].friction);
    laws_[3 * i + 1] = laws_[3 * i + 2] = dynamics::LcpRow::tangent();
  }
}

dynamics::BodyVelocity LocalDynamics::velocity(int port) const noexcept {
  const Vector3d spin(model_.velocity.data() + 6 * port);
  const Vector3d linear(model_.velocity.data() + 6 * port + 3);
  return {.angular = spin + speed_.segment<3>(6 * port), .linear = linear + speed_.segment<3>(6 * port + 3)};
}

LocalTouch LocalDynamics::touched(int pointer) const noexcept {
  LocalTouch touch;
  const ConstMatrix jacobian(model_.contact_jacobian.data(), model_.rows(), 3 * model_.contacts);
  double hardest = 0.0;  // of what is a port
  double hardest_of_all = 0.0;
  for (int i = 0; i < model_.contacts; ++i) {
    const auto& [a, b, friction, gap, normal, to_a, to_b] = model_.contact[i];
    const double pressure = impulses_[3 * i];
    if ((a != pointer && b != pointer) || !(pressure > 0.0)) continue;
    touch.contact = true;
    touch.force += jacobian.block<3, 3>(6 * pointer + 3, 3 * i) * impulses_.segment<3>(3 * i) / model_.tick;
    if (pressure > hardest_of_all) {
      hardest_of_all = pressure;
      touch.normal = Vector3d(normal.data());
    }
    const int other = a == pointer ? b : a;
    if (other < 0 || pressure <= hardest) continue;
    hardest = pressure;
    touch.body = model_.body[other];
  }
  return touch;
}

/// f_0, [torque; force].
LocalDynamics::Vector6 LocalDynamics::coupling_pull(int k, const CouplingTarget& target) const noexcept {
  const CouplingGains& gains = model_.gains[k];
  const PortState& port = ports_[k];
  const double h = model_.tick;
  const Vector3d spin(model_.velocity.data() + 6 * k);
  const Vector3d velocity(model_.velocity.data() + 6 * k + 3);
  const Vector3d turn = math::log_rotation(target.rotation * port.rotation.conjugate());
  Vector6 pull;
  pull << gains.angular_stiffness * (turn + h * (target.angular_velocity - spin)) +
              gains.angular_damping * (target.angular_velocity - spin),
      gains.stiffness * (target.position - port.position + h * (target.velocity - velocity)) +
          gains.damping * (target.velocity - velocity);
  return pull;
}

/// Adds the contacts' impulses to the speeds, which are those without them.
void LocalDynamics::solve_contacts() noexcept {
  const int rows = 3 * model_.contacts;
  const int size = model_.rows();
  const double h = model_.tick;
  const ConstMatrix jacobian(model_.contact_jacobian.data(), size, rows);
  const ConstMatrix response(model_.contact_response.data(), size, rows);
  const ConstMatrix delassus(model_.contact_delassus.data(), rows, rows);
  const ConstRows velocity(model_.velocity.data(), size);
  right_ = speed_ + velocity;
  bias_.noalias() = jacobian.transpose() * right_;
  bool near = false;
  for (int i = 0; i < model_.contacts; ++i) {
    const LocalContact& contact = model_.contact[i];
    // The gap as the ports have moved since; the plane stays.
    const auto moved = [&](int port, const std::array<double, 3>& lever) -> Vector3d {
      const Eigen::Quaterniond turned = ports_[port].rotation * stored_rotation(model_, port).conjugate();
      const Vector3d r(lever.data());
      return ports_[port].position - stored_position(model_, port) + (turned * r - r);
    };
    Vector3d way = moved(contact.port_a, contact.a_to_normal);
    if (contact.port_b >= 0) way -= moved(contact.port_b, contact.b_to_normal);
    const double gap = contact.gap + Vector3d(contact.normal.data()).dot(way);
    bias_[3 * i] += gap > 0.0 ? gap / h : gap / (h + dynamics::kRecoveryTime);
    near = near || bias_[3 * i] < 0.0 || impulses_[3 * i] > 0.0;
  }
  if (!near) {
    impulses_.setZero();
    return;
  }
  const auto report =
      dynamics::solve_lcp(delassus, bias_, std::span<const dynamics::LcpRow>(laws_.data(), rows), impulses_, lcp_);
  if (report.status != dynamics::LcpStatus::kSolved) ++unsolved_;
  speed_.noalias() += response * impulses_;
  wrench_.noalias() += jacobian * (impulses_ / h);
}

void LocalDynamics::move_by(PortState& port, const Vector6& way) noexcept {
  port.rotation = (math::exp_rotation(Vector3d(way.head<3>())) * port.rotation).normalized();
  port.position += way.tail<3>();
}

void LocalDynamics::move() noexcept {
  const double h = model_.tick;
  const ConstRows velocity(model_.velocity.data(), model_.rows());
  way_ += h * speed_;
  right_ = h * (velocity + speed_);
  for (int k = 0; k < model_.ports; ++k) {
    const Vector6 way = right_.segment<6>(6 * k);
    move_by(ports_[k], way);
    if (!model_.own[k]) moved_ += wrench_.segment<6>(6 * k).dot(way);
  }
}

/// The corrections of the hand-over, as far as they are paid for.
void LocalDynamics::shift() noexcept {
  const double part = std::min(model_.tick / model_.length, 1.0);
  double work = 0.0;
  for (int k = 0; k < model_.ports; ++k) {
    if (!model_.own[k]) work += part * wrench_.segment<6>(6 * k).dot(ports_[k].offset);
  }
  double share = 1.0;
  if (work < 0.0) {
    share = std::clamp((ledger_.energy + kEnergyLoan) / -work, 0.0, 1.0);
    ledger_.held_back -= (1.0 - share) * work;
  }
  for (int k = 0; k < model_.ports; ++k) {
    if (model_.own[k]) continue;
    const Vector6 way = share * part * ports_[k].offset;
    move_by(ports_[k], way);
    ports_[k].offset -= way;
  }
  ledger_.energy += share * work;
  if (ledger_.energy < -kEnergyLoan) relax();
  ledger_.lowest = std::min(ledger_.lowest, ledger_.energy);
}

/// Pays back by yielding to the wrenches.
void LocalDynamics::relax() noexcept {
  for (int k = 0; k < model_.ports && ledger_.energy < -kEnergyLoan; ++k) {
    const Vector3d force = wrench_.segment<3>(6 * k + 3);
    const double size = force.norm();
    if (model_.own[k] || !(size > 0.0)) continue;
    const double distance = std::min((-kEnergyLoan - ledger_.energy) / size, kRelaxSpeed * model_.tick);
    Vector6 way = Vector6::Zero();
    way.tail<3>() = distance / size * force;
    move_by(ports_[k], way);
    ports_[k].offset -= way;
    ledger_.energy += distance * size;
    ledger_.relaxed += distance * size;
  }
}

void LocalDynamics::tick(std::span<const CouplingTarget> targets, std::span<PortWrench> on_hands) noexcept {
  std::fill(on_hands.begin(), on_hands.end(), PortWrench{});
  const int pointers = std::min({model_.pointers, static_cast<int>(targets.size()), static_cast<int>(on_hands.size())});
  if (!has_model_ || pointers < model_.pointers) return;
  const int size = model_.rows();
  const double h = model_.tick;
  const ConstMatrix mass(model_.mass.data(), size, size);
  const ConstMatrix spring(model_.spring.data(), size, size);
  const ConstMatrix response(model_.response.data(), size, size);
  for (int k = 0; k < pointers; ++k) pull_.segment<6>(6 * k) = coupling_pull(k, targets[k]);
  right_.noalias() = mass * speed_;
  right_ += h * (ConstRows(model_.drift.data(), size) + pull_);
  right_.noalias() -= h * (spring * way_);
  speed_.noalias() = response * right_;
  wrench_.setZero();
  if (model_.contacts > 0) solve_contacts();
  for (int k = 0; k < pointers; ++k) {
    const CouplingGains& gains = model_.gains[k];
    Vector6 wrench = pull_.segment<6>(6 * k);
    wrench.head<3>() -= (h * gains.angular_stiffness + gains.angular_damping) * speed_.segment<3>(6 * k);
    wrench.tail<3>() -= (h * gains.stiffness + gains.damping) * speed_.segment<3>(6 * k + 3);
    wrench_.segment<6>(6 * k) += wrench;
    on_hands[k] = {.force = -wrench.tail<3>(), .torque = -wrench.head<3>()};
  }
  for (int k = 0; k < model_.ports; ++k) intervals_[k].sum += wrench_.segment<6>(6 * k);
  ++ticks_;
  move();
  shift();
}

/// r of rule 1.
double LocalDynamics::affordable_share() const noexcept {
  const int size = model_.rows();
  const double H = model_.length;
  const ConstMatrix compliance(model_.compliance.data(), size, size);
  Rows means = Rows::Zero(size);
  for (int k = 0; k < model_.ports; ++k) {
    if (!model_.own[k]) means.segment<6>(6 * k) = intervals_[k].mean;
  }
  Rows change(size);
  change.noalias() = compliance * ConstRows(model_.drift.data(), size);
  const double linear = H * means.dot(ConstRows(model_.velocity.data(), size) + H * change);
  change.noalias() = compliance * means;
  const double square = H * H * means.dot(change);
  const double budget = ledger_.energy + given_ + kEnergyLoan;
  if (linear + square <= budget) return 1.0;
  if (!(square > 0.0)) return budget > 0.0 ? std::clamp(budget / linear, 0.0, 1.0) : 0.0;
  // The larger root of square r^2 + linear r = budget; where there is none, the least.
  const double under = linear * linear + 4.0 * square * budget;
  return std::clamp((std::sqrt(std::max(under, 0.0)) - linear) / (2.0 * square), 0.0, 1.0);
}

std::span<const PortLoad> LocalDynamics::end_interval() noexcept {
  for (int k = 0; k < model_.ports; ++k) {
    Interval& interval = intervals_[k];
    interval.mean = ticks_ > 0 ? Vector6(interval.sum / ticks_) : Vector6::Zero();
    interval.sum.setZero();
  }
  given_ = std::exchange(moved_, 0.0);
  const double share = affordable_share();
  std::size_t count = 0;
  for (int k = 0; k < model_.ports; ++k) {
    Vector6& mean = intervals_[k].mean;
    mean *= share;
    if (model_.own[k] || (k >= model_.pointers && mean.isZero(0.0))) continue;
    means_[count++] = {.pointer = k < model_.pointers ? model_.pointer[k] : -1,
                       .port = {.body = model_.body[k], .point = Vector3d(model_.point.data() + 3 * k)},
                       .wrench = {.force = mean.tail<3>(), .torque = mean.head<3>()}};
  }
  ticks_ = 0;
  pending_ = has_model_;
  return {means_.data(), count};
}

}  // namespace layfigure::haptics
