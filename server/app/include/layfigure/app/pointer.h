#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>

#include "layfigure/dynamics/step.h"

namespace layfigure::app {

/// Where a pointer is, in the world.
struct PointerPose {
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};            ///< [m]
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< pointer -> world
};

/// What a pointer holds: a point of a body, through a virtual coupling whose target keeps the offset that the pointer
/// had from the held point when it grabbed:
///     target position = p_pointer + (p_held - p_pointer at the grab)
///     target rotation = R_pointer (R_pointer^T R_held at the grab)
struct Grip {
  int bone{0};                                               ///< index into the rig's bones
  dynamics::Coupling coupling;                               ///< its targets are set before every step
  Eigen::Vector3d position_offset{Eigen::Vector3d::Zero()};  ///< world [m]
  Eigen::Quaterniond rotation_offset{Eigen::Quaterniond::Identity()};
  dynamics::BodyForce force;  ///< of the last step, at the held point
};

/// A hand in the scene. Its pose follows the messages of a client; while it holds something it does not jump to a new
/// pose but glides there at constant velocity (linear and angular) over a given number of steps, so that the doll feels
/// a motion and not a staircase.
class Pointer {
 public:
  [[nodiscard]] const PointerPose& pose() const { return pose_; }
  [[nodiscard]] const std::string& client_id() const { return client_id_; }
  [[nodiscard]] std::int64_t sequence() const { return sequence_; }
  /// Steps between messages, a running mean that forgets half of its past with each. At least 1.
  [[nodiscard]] double message_interval() const { return message_interval_; }
  [[nodiscard]] const std::optional<Grip>& grip() const { return grip_; }

  /// Takes note of a message that comes before step `step`. Without a grip the pose is the new one at once; with one it
  /// stays until glide(). A longer silence than `longest_interval` [steps], >= 1, was a rest: it counts as so long.
  void receive(const PointerPose& pose, std::string client_id, std::int64_t sequence, std::int64_t step,
               double longest_interval);
  /// Moves from the present pose to the newest received one over the next `steps` steps, > 0.
  void glide(std::int64_t steps);

  /// Holds the coupling's point, which is at `held` now. A pointer of which no message has come is taken to be there.
  void attach(Grip grip, const PointerPose& held);
  void detach();

  /// The grip's coupling with its targets for a step of length `h` [s] that begins now. Needs a grip.
  [[nodiscard]] const dynamics::Coupling& aim(double h);
  /// After that step: what the coupling exerted; moves on along the glide.
  void finish_step(const dynamics::BodyForce& force);

 private:
  PointerPose pose_;
  PointerPose newest_;
  std::string client_id_;
  std::int64_t sequence_{0};  // 0: no message yet
  std::int64_t received_at_step_{0};
  double message_interval_{1.0};
  std::optional<Grip> grip_;

  PointerPose glide_from_;
  Eigen::Vector3d glide_shift_{Eigen::Vector3d::Zero()};  // of the whole glide, world
  Eigen::Vector3d glide_turn_{Eigen::Vector3d::Zero()};   // rotation vector of the whole glide, world
  std::int64_t glide_steps_{1};
  std::int64_t glide_done_{1};  // == glide_steps_: at rest
};

}  // namespace layfigure::app
