#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "layfigure/haptics/pointer_pose.h"

namespace layfigure::haptics {

/// A motion at constant velocity, linear and angular, from a pose to another over a number of steps.
class Glide {
 public:
  /// The next `steps` steps, > 0, lead from `from` to `to`.
  void start(const PointerPose& from, const PointerPose& to, std::int64_t steps);
  /// It has arrived, wherever it was.
  void stop() { done_ = steps_; }

  [[nodiscard]] bool moving() const { return done_ < steps_; }
  /// In a step of length `h` [s]: world [m/s] ...
  [[nodiscard]] Eigen::Vector3d velocity(double h) const { return shift_ * rate(h); }
  /// ... and [rad/s].
  [[nodiscard]] Eigen::Vector3d angular_velocity(double h) const { return turn_ * rate(h); }
  /// Where the next step ends; needs moving().
  [[nodiscard]] PointerPose advance();

 private:
  [[nodiscard]] double rate(double h) const { return moving() ? 1.0 / (static_cast<double>(steps_) * h) : 0.0; }

  PointerPose from_;
  PointerPose to_;
  Eigen::Vector3d shift_{Eigen::Vector3d::Zero()};  // of all of it, world
  Eigen::Vector3d turn_{Eigen::Vector3d::Zero()};   // rotation vector of all of it, world
  std::int64_t steps_{1};
  std::int64_t done_{1};
};

}  // namespace layfigure::haptics
