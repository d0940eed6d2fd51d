#pragma once

#include <cstdint>
#include <optional>

#include "layfigure/dynamics/constraints.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/fingertip.h"
#include "layfigure/haptics/glide.h"
#include "layfigure/haptics/pointer_pose.h"
#include "layfigure/haptics/pose_rate.h"
#include "layfigure/haptics/soft_tip.h"
#include "layfigure/haptics/workspace_map.h"

namespace layfigure::haptics {

/// What a pointer holds: a point of a body, through a virtual coupling whose target keeps the offset that the pointer
/// had from the held point when it grabbed:
///     target position = p_pointer + (p_held - p_pointer at the grab)
///     target rotation = R_pointer (R_pointer^T R_held at the grab)
/// A touching pointer holds its fingertip, without any offset.
struct Grip {
  int bone{-1};                                              ///< index into the rig's bones; -1: a fingertip
  dynamics::Coupling coupling;                               ///< its targets are set before every step
  Eigen::Vector3d position_offset{Eigen::Vector3d::Zero()};  ///< world [m]
  Eigen::Quaterniond rotation_offset{Eigen::Quaterniond::Identity()};
  dynamics::BodyForce force;  ///< of the last step, at the held point
};

/// What a fingertip met in the last step.
struct Touched {
  int body{dynamics::kWorld};  ///< of the doll, that it presses hardest on; kWorld: none, or what does not move
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};   ///< of all its contacts and of its magnet on it, world [N]
  bool contact{false};                              ///< it touches something
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};  ///< where it presses hardest, unit, to either side; zero: nowhere
};

struct Fingertip {
  FingertipDefinition definition;
  Touched touched{};
  SoftTip soft{};
  std::optional<dynamics::Tie> bond{};  ///< the magnet holds
};

enum class Tool { kNone, kGrab, kTouch };

/// A hand in the scene: its pose in the world follows its hand's by a WorkspaceMap. With a tool out it does not jump to
/// a new pose but glides there at constant velocity (linear and angular) over a given number of steps, so that the doll
/// feels a motion and not a staircase. Without further poses it stays where it is, and holds what it holds.
class Pointer {
 public:
  [[nodiscard]] const PointerPose& pose() const { return pose_; }
  [[nodiscard]] bool has_pose() const { return has_pose_; }
  [[nodiscard]] const WorkspaceMap& map() const { return map_; }
  [[nodiscard]] Tool tool() const { return fingertip_ ? Tool::kTouch : grip_ ? Tool::kGrab : Tool::kNone; }
  [[nodiscard]] const std::optional<Grip>& grip() const { return grip_; }
  [[nodiscard]] const std::optional<Fingertip>& fingertip() const { return fingertip_; }
  [[nodiscard]] std::optional<Fingertip>& fingertip() { return fingertip_; }

  /// Counts the tools that came out: another number is another grip, however soon.
  [[nodiscard]] std::int64_t tools_taken() const { return tools_taken_; }

  /// The hand's newest pose; finite, unit. Without a tool the pointer is there at once; with one it stays until
  /// glide().
  void receive(const PointerPose& hand);
  /// Moves from the present pose to the newest over the next `steps` steps, > 0.
  void glide(std::int64_t steps);

  /// Is at the newest pose now, a step of `h` [s] after the last: of a device, which tells where it is at every step.
  void follow(double h);

  void set_scale(double scale) { map_.set_scale(scale); }
  void set_clutch(bool held);
  /// Needs a pointer without a tool: it jumps.
  void set_base(const PointerPose& base);
  void set_power_scale(double scale) { map_.set_power_scale(scale); }
  /// The pointer is at `world` where its hand is now. Needs a pointer without a tool.
  void place(const PointerPose& world);

  /// Holds the coupling's point, which is at `held` now. A pointer of which no pose has come is taken to be there.
  void attach(Grip grip, const PointerPose& held);
  /// The grip has these angular gains from now on, and turns the body, which has the rotation `held` now, from there.
  void change_rotation_grip(const dynamics::Coupling& gains, const Eigen::Quaterniond& held);
  /// Holds a fingertip, which is at the pointer's pose.
  void touch(const FingertipDefinition& fingertip, const dynamics::Coupling& coupling);
  /// How the fingertip moves now, before aim(). Needs a fingertip.
  void observe_tip(const TipMotion& tip);
  /// The fingertip is that body of the model from now on.
  void set_fingertip_body(int body);
  void detach();

  /// The grip's coupling with its targets for a step of length `h` [s] that begins now. Needs a grip.
  [[nodiscard]] const dynamics::Coupling& aim(double h);
  /// After that step: what the coupling exerted; moves on along the glide.
  void finish_step(const dynamics::BodyForce& force);

  /// What the hand is to feel, in its own frame: the opposite of what the coupling exerts.
  [[nodiscard]] dynamics::BodyForce force_on_hand() const;

 private:
  WorkspaceMap map_;
  PointerPose pose_;
  PointerPose newest_;
  bool has_pose_{false};
  std::optional<Grip> grip_;
  std::optional<Fingertip> fingertip_;
  std::int64_t tools_taken_{0};

  Glide glide_;
  PoseRate rate_;  // of follow()
  TipMotion tip_;
};

}  // namespace layfigure::haptics
