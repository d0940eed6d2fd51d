#include "layfigure/device/simulated_spidar.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "layfigure/spidar/workspace.h"

namespace layfigure::device {
namespace {

using Eigen::Vector3d;

constexpr double kReferenceShare = 0.1;  // of the most that a motor holds
// After a pause of its caller a simulated device goes on from where it was, as a hand does that was stopped with it.
constexpr double kLongestPause = 0.1;  // [s]
constexpr double kReachShare = 0.5;    // of the way from the centre to the nearest side of the frame
constexpr double kReachAngle = 40.0 * std::numbers::pi / 180.0;  // where forces still can be had every way

/// R_DG: the geometry's axes in the device's. A turn by a quarter about x, written out so that it is exact.
Vector3d to_device_axes(const Vector3d& v) { return {v.x(), -v.z(), v.y()}; }
Vector3d to_geometry_axes(const Vector3d& v) { return {v.x(), v.z(), -v.y()}; }

Eigen::Quaterniond with_axes(const Eigen::Quaterniond& q, const Vector3d& axes) {
  return {q.w(), axes.x(), axes.y(), axes.z()};
}

}  // namespace

Reading to_reading(const spidar::Pose& pose) {
  return {.status = Reading::Status::kOk,
          .position = to_device_axes(pose.position),
          .rotation = with_axes(pose.rotation, to_device_axes(pose.rotation.vec()))};
}

spidar::Pose to_spidar(const Vector3d& position, const Eigen::Quaterniond& rotation) {
  return {.rotation = with_axes(rotation, to_geometry_axes(rotation.vec())), .position = to_geometry_axes(position)};
}

spidar::Wrench to_spidar(const Wrench& wrench) {
  spidar::Wrench result;
  result << to_geometry_axes(wrench.force), to_geometry_axes(wrench.torque);
  return result;
}

Wrench to_device(const spidar::Wrench& wrench) {
  return {.force = to_device_axes(wrench.head<3>()), .torque = to_device_axes(wrench.tail<3>())};
}

Info spidar_info(const spidar::Geometry& geometry) {
  const spidar::Reach reach = spidar::reach_at(geometry, {});
  double half_size = INFINITY;
  for (const Vector3d& motor : geometry.motors) half_size = std::min(half_size, motor.cwiseAbs().minCoeff());
  return {.name = geometry.name,
          .max_force = reach.force,
          .max_torque = reach.wrench * geometry.grip_radius(),
          .reach = kReachShare * half_size,
          .reach_angle = kReachAngle};
}

double reference_tension(const spidar::Geometry& geometry) {
  return std::max(geometry.least_tension, kReferenceShare * geometry.most_tension);
}

SpidarKinematics::SpidarKinematics(spidar::Geometry geometry)
    : geometry_(std::move(geometry)), poses_(geometry_), solver_(geometry_, reference_tension(geometry_)) {}

Reading SpidarKinematics::read(const spidar::Lengths& lengths) noexcept {
  const spidar::PoseEstimate estimate = poses_.solve(lengths);
  good_ = estimate.converged && !estimate.suspicious;
  if (good_) pose_ = estimate.pose;
  Reading reading = to_reading(pose_);
  if (!good_) reading.status = Reading::Status::kInvalid;
  return reading;
}

const spidar::Tensions& SpidarKinematics::tensions(const Wrench& wrench) noexcept {
  if (!good_ && wrench.is_zero()) {
    solution_.tensions.setConstant(geometry_.least_tension);
  } else {
    solution_ = solver_.solve(pose_, to_spidar(wrench), solution_);
  }
  return solution_.tensions;
}

SimulatedSpidarDriver::SimulatedSpidarDriver(spidar::Geometry geometry)
    : kinematics_(geometry), spidar_(std::move(geometry)), info_(spidar_info(kinematics_.geometry())) {
  info_.name += " (simulated)";
  info_.simulated = true;
}

Reading SimulatedSpidarDriver::read(double time) noexcept {
  if (!std::isfinite(time)) return {.status = Reading::Status::kNothingNew};
  if (!started_) {
    started_ = true;
    time_ = last_write_ = time;
  }
  const double passed = std::min(time - time_, kLongestPause);
  if (!(passed > 0.0)) return {.status = Reading::Status::kNothingNew};
  time_ = time;
  if (closed_ || time_ - last_write_ > kWatchdog) spidar_.command(spidar::Tensions::Zero());
  spidar_.advance(passed, wanted_);
  const auto lengths = spidar_.read();
  return lengths ? kinematics_.read(*lengths) : Reading{.status = Reading::Status::kGone};
}

void SimulatedSpidarDriver::write(const Wrench& wrench) noexcept {
  if (closed_) return;
  last_write_ = time_;
  spidar_.command(kinematics_.tensions(possible(wrench, info_)));
}

Wrench SimulatedSpidarDriver::exerted() const noexcept {
  return to_device(-spidar::length_jacobian(spidar_.geometry(), spidar_.grip()).transpose() * spidar_.pulls());
}

void SimulatedSpidarDriver::close() noexcept {
  closed_ = true;
  spidar_.command(spidar::Tensions::Zero());
}

void SimulatedSpidarDriver::aim(const Vector3d& position, const Eigen::Quaterniond& rotation) noexcept {
  if (!position.allFinite() || !rotation.coeffs().allFinite() || rotation.norm() == 0.0) return;
  wanted_ = to_spidar(position, rotation.normalized());
}

}  // namespace layfigure::device
