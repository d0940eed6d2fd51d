#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "layfigure/doll/doll.h"
#include "layfigure/dynamics/constraints.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"

namespace layfigure::haptics {

/// A wish to fasten a bone to the world where it is.
struct PinRequest {
  int bone{0};
  std::optional<Eigen::Vector3d> point{};  ///< in the bone's frame [m]; default as for a grab (GrabRequest)
  bool holds_rotation{false};
  bool rigid{false};
};

/// A bone that is fastened to the world. Either by a coupling, which costs no row of the constraint solver and lets
/// what hangs on it sleep; or rigidly, by a tie.
struct Pin {
  int id{0};
  int bone{0};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};  ///< where it holds the point, world [m]
  bool rigid{false};
  dynamics::Coupling coupling{};  ///< if not rigid
  dynamics::Tie tie{};            ///< if rigid
};

/// The doll's default point of a bone to hold, in its carrier's frame: the com of its body, or the bone's origin if it
/// rides on another's body. Throws std::invalid_argument, one line, if no body carries the bone.
[[nodiscard]] Eigen::Vector3d held_point(const doll::Doll& doll, int bone, const std::optional<Eigen::Vector3d>& point);

/// The pins of a doll, in the order of their ids.
class Pins {
 public:
  /// Of the doll's whole mass `mass` [kg]: a coupling is so stiff, m (2 pi 100 Hz)^2, that the doll would hang 25 um
  /// low from one, critically damped; rotations with the radius of gyration of the pinned body. It is solved
  /// implicitly: no stiffness is too much for the step. Loops that pins close (both hands, and a hand that drags the
  /// trunk) are no loops to the solver with couplings; with ties they are, and where rigid pins and locked joints
  /// contradict each other the answer is the nearest one (lcp.h). Throws as held_point(). Returns the pin's id, which
  /// is not used again.
  int add(const doll::Doll& doll, double mass, const dynamics::State& state, const dynamics::Model& model,
          const PinRequest& request);
  /// False if there is none of that id.
  bool remove(int id);
  void clear() { pins_.clear(); }
  /// These are the pins from now on; ids that were used are still not used again.
  void restore(std::span<const Pin> pins);
  /// Each holds its point where that is now.
  void settle(const dynamics::Model& model, const dynamics::State& state);

  [[nodiscard]] std::span<const Pin> all() const { return pins_; }

 private:
  std::vector<Pin> pins_;
  int next_id_{1};
};

}  // namespace layfigure::haptics
