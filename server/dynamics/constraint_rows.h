#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "layfigure/dynamics/constraints.h"
#include "layfigure/dynamics/limits.h"
#include "path_tree.h"

/// The rows of contacts, ties and limits: their directions, their laws and what they are to close.
namespace layfigure::dynamics {

/// Up to three rows that belong together: a contact, the translation or the rotation of a tie, a bound of a joint.
struct ConstraintBlock {
  enum class Kind { kContact, kTie, kTieRotation, kLimit };

  Kind kind;
  std::uint64_t key;
  int source;  ///< index of the contact or tie; body of the joint
  int rows;
  std::array<LcpRow, 3> laws;
  Jacobian jacobian;
  Eigen::Matrix3d directions;  ///< of the rows' impulses, world
  Eigen::Vector3d bias;        ///< b without the velocity
  Eigen::Vector3d compliance;  ///< S
  double reach;                ///< size of the positions, or of the angles, that the gap comes from
  int first{0};                ///< its first row in the problem
  Eigen::Vector3d impulse{Eigen::Vector3d::Zero()};  ///< lambda
  Eigen::Vector3d applied{Eigen::Vector3d::Zero()};  ///< what of it the factors hold
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  // of the first row, at the line search's last accepted iterate
  double accepted_impulse{0.0};
  double accepted_velocity{0.0};
};

/// A contact that need not act so far: its normal row alone.
struct ContactWatch {
  int source;  ///< index of the contact
  int body_a;
  int body_b;                ///< -1: the world
  Eigen::Vector3d normal;    ///< world
  Eigen::Vector3d moment_a;  ///< of a unit impulse, about the bodies' origins
  Eigen::Vector3d moment_b;
  double bias;  ///< b without the velocity
  double velocity{0.0};
  double accepted_velocity{0.0};  ///< at the line search's last accepted iterate
};

/// A joint that may reach its limits.
struct LimitedJoint {
  int body;
  LimitState state;
  Eigen::Matrix3d axes;  ///< R_WR of the reference axes
  std::array<bool, 3> taken{};

  static constexpr int kBounds = 3;
  [[nodiscard]] const LimitState::Bound& bound(int index) const;
};

// Of a sub-step of length h; the bodies are on the tree. `offset`: its beginning after that of the step [s].
[[nodiscard]] ConstraintBlock contact_block(const PathTree& tree, const Contact& contact, int index, double h,
                                            double offset);
[[nodiscard]] ContactWatch contact_watch(const PathTree& tree, const Contact& contact, int index, double h,
                                         double offset);
/// Under which its block remembers its force.
[[nodiscard]] std::uint64_t block_key(const Contact& contact);
[[nodiscard]] ConstraintBlock tie_block(const PathTree& tree, const Tie& tie, int index, double h);
[[nodiscard]] ConstraintBlock tie_rotation_block(const PathTree& tree, const Tie& tie, int index, double h);
[[nodiscard]] ConstraintBlock limit_block(const LimitedJoint& joint, int bound, double h);

}  // namespace layfigure::dynamics
