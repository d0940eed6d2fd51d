#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "layfigure/dynamics/model.h"

namespace layfigure::dynamics {

/// The state of one joint and of the body behind it. Each number follows a vector of three, so that steps read and
/// write them four at a time.
struct alignas(32) BodyState {
  Eigen::Quaterniond rotation;       ///< R_PB; a root: R_WB
  Eigen::Quaterniond rest_rotation;  ///< R_PB at which the joint is unstrained; flow moves it
  Eigen::Vector3d linear_momentum;   ///< of the body, world [kg m/s]
  double flow;                       ///< accumulated over all flow so far [rad]: what hardening grows with
  Eigen::Vector3d angular_momentum;  ///< of the body about its com, world [kg m^2/s]
  double yield_scale;                ///< softness: scales the joint's yield torque from now on, >= 0
  Eigen::Vector3d trial_torque;      ///< s of the last step, section axes [N m]: t as if nothing flowed (warm start)
  double limit_slack;                ///< the joint can surely turn by this before its limits matter [rad]
  Eigen::Vector3d torque;            ///< t of the last step, in B [N m]: what the joint's strain exerts
  double rest_time;                  ///< for how long the joint, or a root, has been as good as still [s]; steps that
                                     ///< let nothing sleep set it to 0
  Eigen::Vector3d position;          ///< a root's origin in the world [m]; other bodies: the anchor, constant
  bool yielding;                     ///< the joint flowed in the last step
  bool asleep;                       ///< the body rides on its parent: the joint does not move for now. Its momenta are
                                     ///< a part of those of the first body towards the root that is not asleep, about
                                     ///< their common com, and zero here
};

/// What a constraint's rows exerted in the last step: where the solution of the next one is looked for first.
struct ConstraintMemory {
  std::uint64_t key;
  Eigen::Vector3d force;  ///< world [N], or [N m] for rows that act on rotations
};

/// The doll as a whole is at rest: steps change nothing until their inputs do.
struct Rest {
  bool resting{false};
  bool knows_contacts{false};
  std::uint64_t inputs{0};    ///< fingerprint of the couplings, ties and loads that it was last still under
  std::uint64_t contacts{0};  ///< of the contacts; until a step has seen them in the pose of rest, of their names
};

/// Everything that changes: copy it to save it, assign it to restore it; what follows is then the same, bit for bit.
/// Whoever changes it by hand calls wake() first.
struct State {
  double time{0.0};  ///< [s]
  std::vector<BodyState> bodies;
  std::vector<ConstraintMemory> constraints;
  Rest rest;
};

/// The definition's pose, at rest. Joints that are rigid and can never yield sleep for ever: their bodies are one.
[[nodiscard]] State initial_state(const Model& model);

/// Wakes all that sleeps, but for joints that are rigid for ever. Pose, momenta and energy stay as they are. O(n),
/// allocates.
void wake(const Model& model, State& state);

/// Where a body is: X_WB and its com.
struct BodyPose {
  Eigen::Quaterniond rotation;  ///< R_WB
  Eigen::Vector3d origin;       ///< p_WBo [m]
  Eigen::Vector3d com;          ///< p_WBcm [m]
};

/// World poses of all bodies. O(n). `poses` is resized to model.size(); no allocation when it already has that size.
void world_poses(const Model& model, const State& state, std::vector<BodyPose>& poses);

/// What double precision resolves of a sum of energies, relative to the sizes of its parts: 50 operations for each
/// body, their errors adding up like a random walk along a chain of 10 000.
constexpr double kEnergyRounding = 1e-12;
/// What a unit quaternion resolves of a joint's strain [rad]. A stiff spring's energy is uncertain by its torque times
/// this.
constexpr double kAngleRounding = 1e-15;

/// Mechanical energy [J].
struct Energy {
  double kinetic;
  double gravitational;  ///< 0 at the world's origin
  double elastic;        ///< stored in the joints, sum of q^T K_f q / 2
  double rounding;       ///< what the sum may be off by
  [[nodiscard]] double total() const { return kinetic + gravitational + elastic; }
};
[[nodiscard]] Energy energy(const Model& model, const State& state);

}  // namespace layfigure::dynamics
