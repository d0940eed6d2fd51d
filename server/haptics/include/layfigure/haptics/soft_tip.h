#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

/// How a fingertip hangs in its finger while it presses on something: as a soft finger does, that pushes and twists but
/// does not tilt what it holds.
///
/// A soft finger's contact exerts a force and a torque about the normal n, and no torque across it (Mason & Salisbury
/// 1985, "Robot Hands and the Mechanics of Manipulation"): its flesh gives way. A coupling that is stiff against every
/// turn would exert torques across n when the hand tilts that no pad bears, N r / 2 (scene::Pad); the fingertip would
/// turn over on what it holds, and by the part of its angular velocity that is about n twist that as it goes round: by
/// the solid angle 2 pi (1 - cos a) each time that a hand tilted by `a` goes round in a circle, 22 degrees for 20.
///
/// So, while it presses, the coupling's target is not the rotation R_H that the hand wants but
///     R_T = exp(q n) R_0,      q = twist of R_H R_0^T about n
/// with R_0 the fingertip's rotation as it was found. By the twist, a rotation Q is a turn by q about n, and after that
/// one about an axis across n: q = 2 atan2(Q_v . n, Q_w), a function of Q alone. A hand that tilts and comes back has
/// changed nothing, whichever way it went. q changes with the hand's angular velocity w_H by
///     q' = g . w_H,      g = n + (Q_w s x n + (Q_v . n) s) / (Q_w^2 + (Q_v . n)^2),      s = Q_v - (Q_v . n) n
/// so R_T turns at (g . w_H) n, and the hand feels of the torque t that the coupling has against it
///     t_H = (t . n) g,      t_H . w_H = t . (q' n)
/// the transpose of the map: what the hand does is what the coupling is given, to the last digit.
///
/// Across n the fingertip stands where it was found, by the coupling's own spring: so what rests, rests. What would
/// strain that by more than kGivingWay lets it go: R_0 is where it is now, n turns with it, and its tilt is braked no
/// more (the target's angular velocity across n is its own). n is the contact's normal as it was found, fixed in the
/// fingertip, and taken anew when it is off by more than kNormalOff. By R_0 and n anew the spring loses the strain
/// across n, and its twist becomes another, a little more or less; never so much more that it has not lost as much
/// before, of which kMostSpare is kept: no energy comes from that.
///
/// Off what it touches the fingertip turns with the hand again, from where it is.
namespace layfigure::haptics {

/// Strain across the normal that a fingertip holds [rad]: the pads of one that is pressed by a quarter of a millimetre
/// bear the torque.
inline constexpr double kGivingWay = 2e-4;
/// Square of a strain that the coupling lost and may get back [rad^2]: so little that nobody feels it.
inline constexpr double kMostSpare = 1e-4;
/// Angle between the normals of a contact, as it was found and now, from which it is another [rad].
inline constexpr double kNormalOff = 0.1;

/// A turn about an axis, of a rotation.
struct Twist {
  double angle{0.0};                                   ///< q [rad], in (-pi, pi]
  Eigen::Vector3d gradient{Eigen::Vector3d::UnitZ()};  ///< g
  double share{1.0};                                   ///< cosine of half of the rest; 0: there is no such turn
};

/// Of a unit quaternion about a unit axis.
[[nodiscard]] Twist twist_about(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& axis);

/// A fingertip as it is now, world.
struct TipMotion {
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};
  Eigen::Vector3d angular_velocity{Eigen::Vector3d::Zero()};  ///< [rad/s]
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};  ///< of what it presses on, unit, to either side; zero: of nothing
};

/// One per fingertip. Neither allocates, locks, logs nor throws. Not thread-safe.
class SoftTip {
 public:
  struct Target {
    Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< R_T
    Eigen::Vector3d angular_velocity{Eigen::Vector3d::Zero()};
  };

  /// The coupling's target where the hand wants `wanted`, turning at `rate` [rad/s]; `stiffness` [N m/rad] and
  /// `damping` [N m s/rad] are the coupling's. The same again if called again with nothing changed.
  [[nodiscard]] Target follow(const Eigen::Quaterniond& wanted, const Eigen::Vector3d& rate, const TipMotion& tip,
                              double stiffness, double damping) noexcept;

  /// The part of a torque of the coupling that is the hand's, t_H.
  [[nodiscard]] Eigen::Vector3d of_hand(const Eigen::Vector3d& torque) const noexcept;

 private:
  void settle(const Eigen::Quaterniond& wanted, const TipMotion& tip, double strain_squared) noexcept;
  [[nodiscard]] Eigen::Quaterniond target(const Twist& twist) const noexcept;

  bool gives_way_{false};                                         ///< it presses on something
  Eigen::Quaterniond offset_{Eigen::Quaterniond::Identity()};     ///< R_H = wanted offset_
  Eigen::Quaterniond reference_{Eigen::Quaterniond::Identity()};  ///< R_0
  Eigen::Vector3d normal_{Eigen::Vector3d::UnitZ()};              ///< n, world
  Eigen::Vector3d normal_in_tip_{Eigen::Vector3d::UnitZ()};
  Eigen::Vector3d gradient_{Eigen::Vector3d::UnitZ()};  ///< g
  double spare_{0.0};                                   ///< of strains lost, squared
};

}  // namespace layfigure::haptics
