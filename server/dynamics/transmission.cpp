#include "transmission.h"

#include <algorithm>

namespace layfigure::dynamics {

Transmission::Transmission(int bodies) : transmits_(bodies), moments_(bodies), needed_(bodies) {
  transmitting_.reserve(bodies);
}

void Transmission::mark(const Model& model, const RigidGroups& groups, int body) {
  for (; body >= 0 && groups.rides(body) && transmits_[body] == 0; body = model.body(body).parent) {
    transmits_[body] = 1;
    transmitting_.push_back(body);
  }
}

bool Transmission::knows(const RigidGroups& groups, std::span<const Coupling> couplings) const {
  return version_ == groups.version() &&
         std::equal(pulled_.begin(), pulled_.end(), couplings.begin(), couplings.end(),
                    [](int body, const Coupling& coupling) { return body == coupling.body; });
}

void Transmission::find_riders(const Model& model, const RigidGroups& groups, std::span<const Coupling> couplings) {
  for (const int rider : transmitting_) transmits_[rider] = 0;
  transmitting_.clear();
  for (const int carrier : groups.carriers()) mark(model, groups, model.body(carrier).parent);
  for (const Coupling& coupling : couplings) mark(model, groups, coupling.body);
  ++marks_;
  version_ = groups.version();
  pulled_.clear();
  for (const Coupling& coupling : couplings) pulled_.push_back(coupling.body);
}

/// All riders on the way have the same carrier.
void Transmission::carry(const Model& model, const RigidGroups& groups, int body, const Eigen::Quaterniond& R_WC,
                         const Eigen::Vector3d& point, const Wrench& wrench) {
  if (body < 0 || !groups.rides(body)) return;
  const Eigen::Matrix3d R_CW = R_WC.toRotationMatrix().transpose();
  const Eigen::Vector3d force = R_CW * wrench.force;
  const Eigen::Vector3d moment = R_CW * wrench.moment;
  for (; body >= 0 && groups.rides(body); body = model.body(body).parent) {
    moments_[body] += moment + (point - groups.rider(body).origin).cross(force);
  }
}

Transmission::Wrench Transmission::needed_by(const Model& model, const RigidGroup& group, int carrier, const Step& step,
                                             const Pulls& pulls) const {
  const BodyState& before = step.before[carrier];
  const BodyState& after = step.after[carrier];
  const BodyForce load = pulls.loads.empty() ? BodyForce{} : pulls.loads[carrier];
  const Eigen::Vector3d force =
      (after.linear_momentum - before.linear_momentum) / step.h - group.mass * model.gravity() - load.force;
  const Eigen::Vector3d moment = (after.angular_momentum - before.angular_momentum) / step.h - load.torque;
  return {.force = force, .moment = moment + (step.orientations[carrier] * group.com).cross(force)};
}

void Transmission::measure(const Model& model, const RigidGroups& groups, const Step& step, const Pulls& pulls) {
  if (!knows(groups, pulls.on_bodies)) find_riders(model, groups, pulls.on_bodies);
  if (transmitting_.empty()) return;
  for (const int rider : transmitting_) moments_[rider].setZero();
  const auto add = [&](const Wrench& wrench, int carrier, const Eigen::Vector3d& point, int body) {
    const Eigen::Quaterniond& R_WC = step.orientations[carrier];
    if (groups.group(carrier).parent >= 0) {
      needed_[carrier].force += wrench.force;
      needed_[carrier].moment += wrench.moment + (R_WC * point).cross(wrench.force);
    }
    carry(model, groups, body, R_WC, point, wrench);
  };
  // A root hangs on nothing that could transmit what it needs.
  for (const int i : groups.carriers()) {
    if (groups.group(i).parent >= 0) needed_[i] = needed_by(model, groups.group(i), i, step, pulls);
  }
  for (std::size_t k = 0; k < pulls.on_groups.size(); ++k) {
    const Coupling& coupling = pulls.on_groups[k];
    const Wrench wrench{.force = -pulls.forces[k].force, .moment = -pulls.forces[k].torque};
    add(wrench, coupling.body, coupling.point, pulls.on_bodies[k].body);
  }
  const std::vector<int>& carriers = groups.carriers();
  for (auto carrier = carriers.rbegin(); carrier != carriers.rend(); ++carrier) {
    const RigidGroup& group = groups.group(*carrier);
    if (group.parent >= 0) add(needed_[*carrier], group.parent, group.anchor, model.body(*carrier).parent);
  }
}

}  // namespace layfigure::dynamics
