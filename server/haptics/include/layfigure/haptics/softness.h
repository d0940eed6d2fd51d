#pragma once

#include <optional>
#include <vector>

#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"

namespace layfigure::haptics {

/// A joint may be softened to nothing, so that it flows at any torque, or be made this many times as strong.
inline constexpr double kMaxSoftness = 100.0;

/// Scales the yield torques of a doll's joints while hands hold it, so that the same hand can find a pose and keep it.
/// What a joint's yield scale was when the hands took hold it is again, bit for bit, when they have let go.
class Softness {
 public:
  explicit Softness(int bodies) : own_(bodies) {}

  /// Of all joints, `factor` in [0, kMaxSoftness] times the yield torque; forgets what single joints were set to.
  void set(double factor);
  /// Of the joint behind one body.
  void set(int body, double factor);
  [[nodiscard]] double factor(int body) const { return own_[body].value_or(whole_); }

  /// To be called after a change of either: the state's yield scales become what they are to be. Where one changes the
  /// doll wakes. O(bodies).
  void apply(bool held, const dynamics::Model& model, dynamics::State& state);
  /// The state is a new one, whose yield scales are its own.
  void forget_state() { saved_.clear(); }

 private:
  double whole_{1.0};
  std::vector<std::optional<double>> own_;
  std::vector<double> saved_;  ///< yield scales when the hands took hold; empty: they do not hold
};

}  // namespace layfigure::haptics
