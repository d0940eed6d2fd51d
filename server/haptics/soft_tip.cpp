#include "layfigure/haptics/soft_tip.h"

#include <algorithm>
#include <cmath>

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// A hand that is tilted so far that the cosine of half the angle is less has no twist that means anything: 120 degrees.
constexpr double kLeastShare = 0.5;

Vector3d across(const Vector3d& v, const Vector3d& normal) { return v - v.dot(normal) * normal; }

}  // namespace

Twist twist_about(const Quaterniond& rotation, const Vector3d& axis) {
  const double along = rotation.vec().dot(axis);
  const double square = rotation.w() * rotation.w() + along * along;
  Twist twist{.angle = 0.0, .gradient = axis, .share = std::sqrt(square)};
  if (!(square > 0.0)) return twist;
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  twist.angle = 2.0 * std::atan2(sign * along, sign * rotation.w());
  const Vector3d rest = across(rotation.vec(), axis);
  twist.gradient += (rotation.w() * rest.cross(axis) + along * rest) / square;
  return twist;
}

Quaterniond SoftTip::target(const Twist& twist) const noexcept {
  return (math::exp_rotation(twist.angle * normal_) * reference_).normalized();
}

/// The fingertip is where it belongs now, but for the twist between it and the hand: of that stays what is paid for by
/// the strain that there was.
void SoftTip::settle(const Quaterniond& wanted, const TipMotion& tip, double strain_squared) noexcept {
  normal_ = (tip.rotation * normal_in_tip_).normalized();
  reference_ = tip.rotation;
  const Quaterniond between = wanted * offset_ * reference_.conjugate();
  const double twist = twist_about(between, normal_).angle;
  const double paid = spare_ + strain_squared;
  const double kept = std::clamp(twist, -std::sqrt(paid), std::sqrt(paid));
  spare_ = std::min(paid - kept * kept, kMostSpare);
  if (kept == twist) return;
  // The twist comes first, so to take of it is to turn what the hand's rotation begins with.
  offset_ = (wanted.conjugate() * between * math::exp_rotation((kept - twist) * normal_) * reference_).normalized();
}

SoftTip::Target SoftTip::follow(const Quaterniond& wanted, const Vector3d& rate, const TipMotion& tip, double stiffness,
                                double damping) noexcept {
  if (tip.normal.isZero(0.0)) {
    if (gives_way_) {
      const Quaterniond between = wanted * offset_ * reference_.conjugate();
      offset_ = (wanted.conjugate() * target(twist_about(between, normal_))).normalized();
    }
    gives_way_ = false;
    return {.rotation = wanted * offset_, .angular_velocity = rate};
  }
  const Vector3d normal_in_tip = tip.rotation.conjugate() * tip.normal;
  const bool known = gives_way_ && std::abs(normal_in_tip.dot(normal_in_tip_)) > std::cos(kNormalOff);
  Twist twist;
  Vector3d strain;
  bool holds = false;
  if (known) {
    twist = twist_about(wanted * offset_ * reference_.conjugate(), normal_);
    strain = math::log_rotation(target(twist) * tip.rotation.conjugate());
    const Vector3d pull = stiffness * strain - damping * tip.angular_velocity;
    holds = across(pull, normal_).norm() <= stiffness * kGivingWay;
  } else if (gives_way_) {
    const Quaterniond before = target(twist_about(wanted * offset_ * reference_.conjugate(), normal_));
    strain = math::log_rotation(before * tip.rotation.conjugate());
  } else {
    strain = math::log_rotation(wanted * offset_ * tip.rotation.conjugate());
  }
  if (!known) normal_in_tip_ = normal_in_tip;
  gives_way_ = true;
  if (!holds) {
    settle(wanted, tip, strain.squaredNorm());
    twist = twist_about(wanted * offset_ * reference_.conjugate(), normal_);
    holds = damping * across(tip.angular_velocity, normal_).norm() <= stiffness * kGivingWay;
  }
  if (twist.share < kLeastShare) {
    offset_ = (wanted.conjugate() * target(twist)).normalized();
    twist = twist_about(wanted * offset_ * reference_.conjugate(), normal_);
  }
  gradient_ = twist.gradient;
  const Vector3d along = gradient_.dot(rate) * normal_;
  return {.rotation = target(twist),
          .angular_velocity = holds ? along : Vector3d(along + across(tip.angular_velocity, normal_))};
}

Vector3d SoftTip::of_hand(const Vector3d& torque) const noexcept {
  return gives_way_ ? Vector3d(torque.dot(normal_) * gradient_) : torque;
}

}  // namespace layfigure::haptics
