#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/pointer_pose.h"

namespace layfigure::haptics {

/// Translation scales that a map may have: from a device of a metre that works on a millimetre to the reverse.
inline constexpr double kMinScale = 1e-3;
inline constexpr double kMaxScale = 1e3;
/// Power scales: kMinScale^2 makes the stiffness of a world a thousand times as large as the hand's its own.
inline constexpr double kMinPowerScale = 1e-6;
inline constexpr double kMaxPowerScale = 1e6;

/// From the pose of a hand, or of a device's grip, to the pose of its pointer in the world. With (p_D, R_D) the hand in
/// its device's frame D,
///     p_W = o + s R_WD p_D,      R_W = R_WD R_D C
/// s is the translation scale, R_WD how the device stands in the world, and o and C what scale and clutch have left: by
/// them the pointer never jumps.
///   - A new scale s' at the hand's present pose: o grows by (s - s') R_WD p_D.
///   - The clutch: while it is held the pointer stays where it is and the hand moves freely, to grip anew; o and C
///     follow from the poses at its release.
///   - A new base frame places the pointer anew, o = p_WD and C = 1; place() does it with the hand where it is. These
///     alone move it.
///
/// Forces go back by the transpose, times a power scale P,
///     f_hand = P s R_WD^T f_W,      t_hand = P R_WD^T t_W
/// so that f_hand . v_hand + t_hand . w_hand = P (f_W . v_W + t_W . w_W) at any translation scale and while that
/// changes. With P = 1 the hand takes out what the world gives, no more. With any other P > 0 its energy is the world's
/// times P: a world that is passive stays so in the hand as long as P is constant while something is held, and for two
/// hands on one thing as long as theirs is the same. The hand feels a stiffness k of the world as P s^2 k: a small
/// device on a large doll needs a small P, or no motor would do. Scaling the force alone (P s constant while s changes)
/// is not passive, and torques would not go with it; this map does not do it. While the clutch is held the pointer does
/// not follow, so the hand feels nothing.
class WorkspaceMap {
 public:
  /// The hand is here now.
  void receive(const PointerPose& hand);
  /// Where its pointer is to be. Exactly the hand's pose as long as nothing was set.
  [[nodiscard]] const PointerPose& world() const { return world_; }

  [[nodiscard]] double scale() const { return scale_; }
  /// `scale` in [kMinScale, kMaxScale].
  void set_scale(double scale);
  [[nodiscard]] bool clutched() const { return clutched_; }
  void set_clutch(bool held);
  /// Pose of the device's frame in the world; ends a clutch.
  void set_base(const PointerPose& base);
  [[nodiscard]] double power_scale() const { return power_scale_; }
  /// `scale` in [kMinPowerScale, kMaxPowerScale].
  void set_power_scale(double scale) { power_scale_ = scale; }

  /// The pointer is at `world` where the hand is now: o and C follow; ends a clutch.
  void place(const PointerPose& world);
  /// Where the hand would have to be for the pointer to be at `world`: the map's inverse.
  [[nodiscard]] PointerPose to_device(const PointerPose& world) const;

  /// What the hand is to feel, in its device's frame, where `on_pointer` [N, N m] is what the world exerts on the
  /// pointer.
  [[nodiscard]] dynamics::BodyForce to_hand(const dynamics::BodyForce& on_pointer) const;

 private:
  [[nodiscard]] Eigen::Vector3d scaled(const Eigen::Vector3d& p_D) const { return scale_ * (base_ * p_D); }

  PointerPose hand_;   // newest
  PointerPose world_;  // its pointer
  double scale_{1.0};
  double power_scale_{1.0};
  Eigen::Quaterniond base_{Eigen::Quaterniond::Identity()};  // R_WD
  Eigen::Vector3d offset_{Eigen::Vector3d::Zero()};          // o
  Eigen::Quaterniond turn_{Eigen::Quaterniond::Identity()};  // C
  bool clutched_{false};
};

}  // namespace layfigure::haptics
