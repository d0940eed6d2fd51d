#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "layfigure/dynamics/limits.h"

namespace layfigure::dynamics {

/// How fast an overloaded joint flows (t the torque of the strain, t_y the yield torque, D_d the flow damping).
enum class FlowLaw {
  kPaper,       ///< w_d = t / D_d as soon as |t| > t_y; on |t| = t_y any rate from 0 to t_y / D_d (Matsunaga, Eq. 1)
  kOverstress,  ///< w_d = max(0, |t| - t_y) / D_d along t (Bingham, Perzyna)
};

/// How the bodies without a parent are held.
enum class RootKind {
  kBall,   ///< by a ball joint to the world, at the body's anchor, with its joint law
  kFree,   ///< not at all: six degrees of freedom. Pin it where wanted with a Coupling (step.h)
  kFixed,  ///< welded to the world
};

/// How the law of a joint differs between the axes of its cross-section.
struct JointShape {
  Eigen::Quaterniond axes{Eigen::Quaterniond::Identity()};  ///< R_BS: x twist, y and z bends, in the child's frame
  Eigen::Vector3d stiffness{1.0, 1.0, 1.0};                 ///< ratios of K_f, >= 0
  Eigen::Vector3d damping{1.0, 1.0, 1.0};                   ///< ratios of D_f, >= 0
  Eigen::Vector3d yield{1.0, 1.0,
                        1.0};  ///< ratios of t_y (semi-axes of the yield ellipsoid), > 0; infinity: never yields
  std::array<bool, 3> locked{false, false, false};  ///< axes that do not turn at all
};

/// Stiffness at which an axis counts as rigid [N m/rad]: it gives 1e-9 rad per N m, what a step's rounding leaves.
/// Larger values, infinity among them, are taken as this.
constexpr double kRigidStiffness = 1e9;

/// The elasto-plastic law of one ball joint: a Kelvin-Voigt element (K_f, D_f) in series with a flow element that moves
/// only at the yield torque. See joint_law.h for the equations.
struct JointLaw {
  double stiffness{0.0};                                         ///< K_f [N m/rad], >= 0; infinity: rigid until yield
  double damping{0.0};                                           ///< D_f [N m s/rad], >= 0
  double flow_damping{0.0};                                      ///< D_d [N m s/rad], >= 0; 0 flows freely at yield
  double yield_torque{std::numeric_limits<double>::infinity()};  ///< t_y [N m], >= 0; infinity: purely elastic
  double hardening{0.0};                                         ///< H [N m/rad], >= 0: growth of t_y with the flow
  JointShape shape{};
};

/// A body turns at least like a ball with this radius of gyration [m]. It gives point masses and infinitely thin rods,
/// whose joints could otherwise move without any effort, an inertia far below that of anything with a size.
constexpr double kSmallestGyration = 1e-5;

/// One rigid body and the ball joint that ties it to its parent. The body's frame B has its origin at that joint.
struct BodyDefinition {
  std::string name;
  int parent{-1};                                   ///< index of an earlier body; -1: a root
  Eigen::Vector3d anchor{Eigen::Vector3d::Zero()};  ///< p_PoBo_P: the joint, in the parent's frame; a root: world [m]
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};       ///< R_PB at the start; a root: R_WB
  Eigen::Quaterniond rest_rotation{Eigen::Quaterniond::Identity()};  ///< R_PB at which the joint is unstrained
  double mass{1.0};                                                  ///< [kg], > 0
  Eigen::Vector3d com{Eigen::Vector3d::Zero()};                      ///< p_BoBcm_B [m]
  Eigen::Matrix3d inertia{Eigen::Matrix3d::Identity()};              ///< I_BBcm_B [kg m^2], positive semidefinite
  JointLaw joint;
  JointLimits limits;
};

/// All that a doll's physics is made from. Safe to fill in any order; Model checks it.
struct ModelDefinition {
  std::vector<BodyDefinition> bodies;  ///< parents before children
  FlowLaw law{FlowLaw::kPaper};
  RootKind root{RootKind::kBall};
  Eigen::Vector3d gravity{0.0, 0.0, -9.81};  ///< world [m/s^2]
};

/// An immutable articulated body in tree order. Shareable between threads.
class Model {
 public:
  /// Checks the definition. O(n). Throws std::invalid_argument that names the body, the value and the allowed range:
  /// NaN or infinite values, masses that are not positive, inertias that are not those of a mass, parents that do not
  /// come before their children, quaternions that are not unit.
  explicit Model(ModelDefinition definition);

  [[nodiscard]] int size() const { return static_cast<int>(definition_.bodies.size()); }
  [[nodiscard]] const BodyDefinition& body(int index) const { return definition_.bodies[index]; }
  [[nodiscard]] FlowLaw law() const { return definition_.law; }
  [[nodiscard]] RootKind root() const { return definition_.root; }
  [[nodiscard]] const Eigen::Vector3d& gravity() const { return definition_.gravity; }
  /// Index of the body of that name, -1 if there is none. O(n).
  [[nodiscard]] int find(const std::string& name) const;

 private:
  ModelDefinition definition_;
};

}  // namespace layfigure::dynamics
