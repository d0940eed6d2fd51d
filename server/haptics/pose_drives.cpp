#include "layfigure/haptics/pose_drives.h"

#include <algorithm>
#include <cmath>

namespace layfigure::haptics {
namespace {

constexpr double kDriveTime = 0.02;    // [s]: time constant of a drive near its target
constexpr double kSettleTime = 0.1;    // [s]: who has been there for so long has arrived
constexpr double kRigidReach = 1e-4;   // [rad]: of a drive without bound
constexpr double kElasticAngle = 0.5;  // [rad]: a drive of a joint that never yields could strain it by

double default_torque(const dynamics::JointLaw& law) {
  if (std::isfinite(law.yield_torque)) return kDriveStrength * law.yield_torque;
  return kElasticAngle * std::min(law.stiffness, dynamics::kRigidStiffness);
}

dynamics::Drive make_drive(int body, const dynamics::JointLaw& law, const std::optional<double>& max_torque) {
  dynamics::Drive drive;
  drive.body = body;
  drive.max_torque = max_torque.value_or(default_torque(law));
  drive.stiffness = std::max(drive.max_torque, kRigidReach) / kDriveReach;
  drive.damping = kDriveTime * drive.stiffness;
  return drive;
}

}  // namespace

void PoseDrives::load(const PoseRequest& request, const dynamics::Model& model, const dynamics::State& state,
                      double h) {
  const auto steps = std::max<std::int64_t>(1, std::llround(request.duration / h));
  for (const auto& [body, rotation] : request.targets) {
    auto place = std::ranges::lower_bound(joints_, body, {}, &Joint::body);
    const auto index = place - joints_.begin();
    if (place == joints_.end() || place->body != body) {
      const Eigen::Quaterniond now = state.bodies[body].rotation;
      place = joints_.insert(
          place, {.body = body, .glide = {}, .target = now, .end = now, .exerted = Eigen::Vector3d::Zero()});
      drives_.insert(drives_.begin() + index, dynamics::Drive{});
    }
    drives_[index] = make_drive(body, model.body(body).joint, request.max_torque);
    place->end = rotation;
    place->glide.start({.position = Eigen::Vector3d::Zero(), .rotation = place->target},
                       {.position = Eigen::Vector3d::Zero(), .rotation = rotation}, steps);
  }
  hold_ = request.hold;
  arrived_steps_ = 0;
}

bool PoseDrives::drives(int body) const {
  const auto place = std::ranges::lower_bound(joints_, body, {}, &Joint::body);
  return place != joints_.end() && place->body == body;
}

int PoseDrives::on_the_way(const dynamics::State& state) const {
  return static_cast<int>(std::ranges::count_if(joints_, [&](const Joint& joint) {
    return joint.glide.moving() || state.bodies[joint.body].rotation.angularDistance(joint.end) > kDriveReach;
  }));
}

std::span<const dynamics::Drive> PoseDrives::aim(double h) {
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    drives_[k].target_rotation = joints_[k].target;
    drives_[k].target_velocity = joints_[k].glide.angular_velocity(h);
  }
  return drives_;
}

bool PoseDrives::finish_step(const dynamics::State& state, double h) {
  for (Joint& joint : joints_) {
    if (joint.glide.moving()) joint.target = joint.glide.advance().rotation;
    if (!joint.glide.moving()) joint.target = joint.end;
  }
  arrived_steps_ = on_the_way(state) == 0 ? arrived_steps_ + 1 : 0;
  return !hold_ && static_cast<double>(arrived_steps_) * h >= kSettleTime;
}

}  // namespace layfigure::haptics
