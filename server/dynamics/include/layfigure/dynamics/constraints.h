#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>

#include "layfigure/dynamics/lcp.h"

/// What bounds the motion of a step beside the joints: contacts, ties and joint limits (limits.h). Each is a row, or
/// three, of the step's complementarity problem
///     v = v_free + J M^-1 J^T lambda,    law(lambda, v + S lambda + b)
/// with M^-1 the implicit step's response, the Delassus matrix J M^-1 J^T computed along the touched paths alone.
///
/// An open contact or limit of gap x may close just up to contact, b = x / h, so that nothing passes into it; an
/// overlap is undone over a time constant, b = x / (h + kRecoveryTime), so that what touches is not thrown apart. So is
/// a rigid tie's gap, at most at a largest speed: a time constant that does not follow h keeps the error's expansion in
/// h smooth, which extrapolation needs. A compliant tie is a spring and damper in their stable implicit form (Tazaki &
/// Hasegawa 2006):
///     S = 1 / (h (h K + B)),   b = K / (h K + B) x
namespace layfigure::dynamics {

/// The body index of what does not move.
constexpr int kWorld = -1;

/// Time constant with which an overlap or a rigid tie's gap is undone [s].
constexpr double kRecoveryTime = 0.01;
/// At which a rigid tie closes a gap at most [m/s], [rad/s].
constexpr double kLargestClosingSpeed = 1.0;
constexpr double kLargestClosingSpin = 10.0;

/// A point at which a body touches, or may touch within the step, another or the world. Coulomb friction, no
/// restitution: an impact ends at rest.
struct Contact {
  int body_a{0};
  int body_b{kWorld};
  Eigen::Vector3d point_a{Eigen::Vector3d::Zero()};           ///< on a's surface, in a's frame [m]
  Eigen::Vector3d point_b{Eigen::Vector3d::Zero()};           ///< on b's surface, in b's frame [m]
  Eigen::Vector3d normal{Eigen::Vector3d::UnitZ()};           ///< from b to a, world, unit
  double friction{0.5};                                       ///< Coulomb's coefficient, >= 0
  Eigen::Vector3d surface_velocity{Eigen::Vector3d::Zero()};  ///< of b's material at the point beside b's own motion,
                                                              ///< world [m/s]: a pushed pointer, a moving belt
  std::uint64_t key{0};                                       ///< names the point from one step to the next
};

/// Holds a point of one body to a point of another or of the world; optionally their rotations too. Rigid unless given
/// a stiffness. Couplings (step.h) to the world cost less where they will do: a tie is for what they cannot be,
/// between two bodies (closed loops), rigid, or limited in force.
struct Tie {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  int body_a{0};
  int body_b{kWorld};
  Eigen::Vector3d point_a{Eigen::Vector3d::Zero()};  ///< in a's frame [m]
  Eigen::Vector3d point_b{Eigen::Vector3d::Zero()};  ///< in b's frame [m]
  double stiffness{kInfinity};                       ///< [N/m], > 0; infinity: rigid
  double damping{0.0};                               ///< [N s/m], >= 0
  double max_force{kInfinity};                       ///< largest component in the world's axes [N], >= 0
  bool holds_rotation{false};
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< R_BA held, of a in b
  double angular_stiffness{kInfinity};                          ///< [N m/rad], > 0; infinity: rigid
  double angular_damping{0.0};                                  ///< [N m s/rad], >= 0
  double max_torque{kInfinity};                                 ///< largest component in the world's axes [N m], >= 0
};

/// How the rows of a step were solved.
struct ConstraintReport {
  int rows{0};           ///< that were solved for, in the last sub-step
  int acting{0};         ///< contacts, ties and limits that exerted something then
  int iterations{0};     ///< linear systems that the worst problem took (LcpReport::iterations)
  int unsolved{0};       ///< problems that were not solved to kLcpTolerance; their answers are bounded (lcp.h)
  double residual{0.0};  ///< largest relative complementarity residual
  LcpStatus status{LcpStatus::kSolved};  ///< of the problem of that residual
};

}  // namespace layfigure::dynamics
