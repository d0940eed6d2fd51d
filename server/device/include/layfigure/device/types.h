#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>

namespace layfigure::device {

/// Where the grip is in the device's frame D: right-handed, x right, y away from the user, z up, its origin where the
/// grip rests, its rotation the identity there.
struct Reading {
  enum class Status {
    kOk,
    kNothingNew,  ///< since the last reading
    kInvalid,     ///< the device tells something that cannot be
    kGone,        ///< it is not there any more, or not yet
  };
  Status status{Status::kNothingNew};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};            ///< p_DS [m]
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< R_DS, unit
  double grip{0.0};                                             ///< 0 open .. 1 squeezed
  std::uint32_t buttons{0};                                     ///< bit k: button k is down
};

/// What the hand is pushed with, in the device's frame.
struct Wrench {
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};   ///< [N]
  Eigen::Vector3d torque{Eigen::Vector3d::Zero()};  ///< about the grip's origin [N m]

  [[nodiscard]] bool is_finite() const { return force.allFinite() && torque.allFinite(); }
  [[nodiscard]] bool is_zero() const { return force.isZero(0.0) && torque.isZero(0.0); }
};

/// What a device is like.
struct Info {
  std::string name;
  double max_force{0.0};    ///< [N], >= 0; 0: it cannot push
  double max_torque{0.0};   ///< [N m], >= 0; 0: it cannot turn
  double reach{0.0};        ///< how far its grip gets from the origin [m], > 0
  double reach_angle{0.0};  ///< how far it turns from rest [rad], >= 0
  bool simulated{false};    ///< it passes its time by what it is told at read(): no clock of its own

  [[nodiscard]] bool feels_force() const { return max_force > 0.0; }
  [[nodiscard]] bool feels_torque() const { return max_torque > 0.0; }
};

/// `v`, shortened to a size of `most` if it is longer.
[[nodiscard]] inline Eigen::Vector3d shortened(const Eigen::Vector3d& v, double most) {
  const double size = v.stableNorm();
  return size > most ? Eigen::Vector3d(v / size * most) : v;
}

/// What a device can exert of a wrench: cut to its force and torque, nothing of one that is not finite.
[[nodiscard]] inline Wrench possible(const Wrench& wrench, const Info& info) {
  if (!wrench.is_finite()) return {};
  return {.force = shortened(wrench.force, info.max_force), .torque = shortened(wrench.torque, info.max_torque)};
}

}  // namespace layfigure::device
