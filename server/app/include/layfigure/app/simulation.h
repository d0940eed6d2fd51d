#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "layfigure/app/pointer.h"
#include "layfigure/app/step_statistics.h"
#include "layfigure/doll/doll.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/scene/scene.h"

namespace layfigure::app {

enum class ClockKind {
  kRealtime,  ///< simulation time follows the wall clock
  kLockstep,  ///< simulation time advances by step commands only
};

struct SimulationSettings {
  double physics_hz{1000.0};  ///< steps per second of simulation time, > 0
  double pose_hz{60.0};       ///< poses per second of simulation time, in (0, physics_hz]
  ClockKind clock{ClockKind::kRealtime};
};

/// A wish to hold a bone.
struct GrabRequest {
  int pointer{0};
  int bone{0};
  std::optional<Eigen::Vector3d> point{};  ///< in the bone's frame [m]; default: the com of its body, or the bone's
                                           ///< origin if it rides on another's body
  std::optional<double> stiffness{};       ///< [N/m], > 0; default: see Simulation::grab
  std::optional<double> damping{};         ///< [N s/m], >= 0; default: see Simulation::grab
  bool holds_rotation{false};              ///< 6-DOF: the rotation is held too
};

/// The doll, its state, the pointers that pull at it, and simulation time. Single-threaded; knows no messages and no
/// clock.
class Simulation {
 public:
  Simulation(doll::Doll doll, const SimulationSettings& settings);

  [[nodiscard]] const doll::Doll& doll() const { return doll_; }
  [[nodiscard]] const SimulationSettings& settings() const { return settings_; }
  [[nodiscard]] const dynamics::State& state() const { return state_; }
  [[nodiscard]] const StepStatistics& statistics() const { return statistics_; }
  [[nodiscard]] const std::map<int, Pointer>& pointers() const { return pointers_; }
  [[nodiscard]] std::int64_t steps() const { return steps_; }
  /// Simulation time [us], rounded from the exact steps / physics_hz: it does not drift.
  [[nodiscard]] std::int64_t time_us() const;
  [[nodiscard]] int yielding_joints() const { return yielding_joints_; }
  [[nodiscard]] dynamics::Energy energy() const { return dynamics::energy(scene_.model(), state_); }
  /// The doll is at rest as a whole, and nothing has happened since that could disturb it: steps would change nothing.
  [[nodiscard]] bool resting() const { return resting_; }
  /// So many steps pass in which the resting doll stays as it is.
  void rest(std::int64_t steps);
  /// Why no step is possible any more until reset(), "" if it is.
  [[nodiscard]] const std::string& failure() const { return failure_; }

  /// Takes note of where pointer `id` is to be. An older message of the same client is ignored.
  /// A pointer that holds something moves there at constant velocity: with the realtime clock from now on, over the
  /// mean time between its messages (at least a step, at most 50 ms), so that it lags by about one message, a 60 Hz
  /// mouse is no staircase and a burst of messages no blow; with the lockstep clock over the steps of the next
  /// begin_motion().
  void point(int id, const PointerPose& pose, const std::string& client_id, std::int64_t sequence);

  /// Lockstep: the pointers glide to their newest poses over the next `steps` steps, > 0.
  void begin_motion(std::int64_t steps);

  /// Holds a bone with a virtual coupling. Nothing jumps: the pointer's pose now corresponds to the held point as it is
  /// now. Defaults: stiffness k = m (2 pi 3 Hz)^2 with the doll's whole mass m, so that the doll hangs from the pointer
  /// 28 mm low; damping = 2 sqrt(k m), critical for the whole doll. A 6-DOF grip turns with r^2 times these, r the held
  /// body's radius of gyration. Throws std::invalid_argument, one line, if the pointer holds something already or the
  /// bone cannot be held; nothing has changed then. Returns the held point, world.
  Eigen::Vector3d grab(const GrabRequest& request);

  /// Throws std::invalid_argument if the pointer holds nothing.
  void release(int pointer);

  /// The initial pose at rest; all pointers released. Time goes on: time stamps never go back.
  void reset();

  /// One step. False if it failed, see failure(); the state is then the last good one.
  bool advance();

  /// Where the held point is, with the rotation of the body that it belongs to. O(bodies).
  [[nodiscard]] PointerPose held_pose(const Grip& grip) const;

 private:
  void pin_roots();
  void collect_couplings();
  void distribute_forces();
  [[nodiscard]] dynamics::Coupling make_coupling(const GrabRequest& request) const;

  doll::Doll doll_;
  SimulationSettings settings_;
  scene::Scene scene_;
  dynamics::State state_;
  double total_mass_{0.0};  ///< [kg]
  std::vector<dynamics::Coupling> pins_;
  std::vector<dynamics::Coupling>
      couplings_;  ///< of the step at hand: the pins, then the grips in the order of pointers
  std::map<int, Pointer> pointers_;
  StepStatistics statistics_;
  std::int64_t steps_{0};
  int yielding_joints_{0};
  bool resting_{false};
  std::string failure_;
};

}  // namespace layfigure::app
