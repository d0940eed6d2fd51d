#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/glide.h"

namespace layfigure::haptics {

/// A drive pulls with all its torque where its joint is so far from the target [rad]; nearer, in proportion.
inline constexpr double kDriveReach = 0.005;
/// Of a drive unless told otherwise: this multiple of its joint's yield torque, which holds the limb twice over.
inline constexpr double kDriveStrength = 3.0;

/// A wish to turn joints.
struct PoseRequest {
  std::vector<std::pair<int, Eigen::Quaterniond>> targets;  ///< of bodies: R_PB
  double duration{0.5};                                     ///< of the way there, at constant velocity [s], > 0
  std::optional<double> max_torque{};                       ///< [N m], > 0; default: see kDriveStrength
  bool hold{false};                                         ///< driven on when all have arrived
};

/// Turns joints towards target rotations by drives (dynamics/step.h) of limited torque, as a puppet's strings or motion
/// capture do. Driven joints do not resist elastically: their yield torque is none, so that they flow to where they are
/// driven, and stay. What a drive held against gravity its joint's spring holds after it. Joints that never yield are
/// driven against their springs, and spring back.
class PoseDrives {
 public:
  /// These joints have new targets; those that are driven already and not named keep theirs. A driven joint's target
  /// moves on from where it is, another's from the joint. `h`: of a step [s].
  void load(const PoseRequest& request, const dynamics::Model& model, const dynamics::State& state, double h);
  void clear() { joints_.clear(), drives_.clear(), arrived_steps_ = 0; }

  [[nodiscard]] bool active() const { return !joints_.empty(); }
  /// Joints that are driven and not yet at their targets' ends.
  [[nodiscard]] int on_the_way(const dynamics::State& state) const;
  [[nodiscard]] int count() const { return static_cast<int>(joints_.size()); }
  [[nodiscard]] bool drives(int body) const;

  /// Of a step of length `h` that begins now. Allocates nothing.
  [[nodiscard]] std::span<const dynamics::Drive> aim(double h);
  /// What drive `index` of aim() exerted in that step, world [N m].
  void observe(int index, const Eigen::Vector3d& torque) { joints_[index].exerted = torque; }
  [[nodiscard]] const Eigen::Vector3d& exerted(int index) const { return joints_[index].exerted; }
  /// After that step: moves the targets on. True when all have been where they are to be for a while, and are not held.
  [[nodiscard]] bool finish_step(const dynamics::State& state, double h);

 private:
  struct Joint {
    int body;
    Glide glide;
    Eigen::Quaterniond target;  ///< at the beginning of the step
    Eigen::Quaterniond end;
    Eigen::Vector3d exerted;  ///< in the last step, world [N m]
  };
  std::vector<Joint> joints_;  ///< by body
  std::vector<dynamics::Drive> drives_;
  bool hold_{false};
  std::int64_t arrived_steps_{0};  ///< for so long all have been there
};

}  // namespace layfigure::haptics
