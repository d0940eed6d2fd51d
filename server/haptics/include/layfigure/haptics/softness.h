#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"

namespace layfigure::haptics {

/// A joint may be softened to nothing, so that it flows at any torque, or be made this many times as strong.
inline constexpr double kMaxSoftness = 100.0;

/// What was set: of all joints, and of single ones, by their bodies.
struct SoftnessFactors {
  double whole{1.0};
  std::vector<std::optional<double>> own;
};

/// Scales the yield torques of a doll's joints while hands hold it, so that the same hand can find a pose and keep it.
/// What a joint's yield scale was when the hands took hold it is again, bit for bit, when they have let go.
class Softness {
 public:
  explicit Softness(int bodies)
      : factors_{.whole = 1.0, .own = std::vector<std::optional<double>>(bodies)}, loose_(bodies) {}

  /// Of all joints, `factor` in [0, kMaxSoftness] times the yield torque; forgets what single joints were set to.
  void set(double factor);
  /// Of the joint behind one body.
  void set(int body, double factor);
  [[nodiscard]] double factor(int body) const { return factors_.own[body].value_or(factors_.whole); }
  [[nodiscard]] const SoftnessFactors& factors() const { return factors_; }
  /// As they were set before, of as many bodies.
  void restore(SoftnessFactors factors) { factors_ = std::move(factors); }
  /// The joint behind the body has no yield torque for now, whoever holds the doll.
  void set_loose(int body, bool loose) { loose_[body] = loose; }

  /// To be called after a change of either: the state's yield scales become what they are to be. Where one changes the
  /// doll wakes. O(bodies).
  void apply(bool held, const dynamics::Model& model, dynamics::State& state);
  /// The state is a new one, whose yield scales are its own.
  void forget_state() { saved_.clear(); }

 private:
  SoftnessFactors factors_;
  std::vector<bool> loose_;
  std::vector<double> saved_;  ///< yield scales when the hands took hold; empty: they do not hold
};

}  // namespace layfigure::haptics
