#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "layfigure/app/pointer_input.h"
#include "layfigure/app/step_statistics.h"
#include "layfigure/doll/doll.h"
#include "layfigure/doll/joint_override.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/device_hands.h"
#include "layfigure/haptics/hands.h"
#include "layfigure/session/history.h"
#include "layfigure/session/mirror.h"
#include "layfigure/session/posed.h"

namespace layfigure::app {

using haptics::GrabRequest;
using haptics::Grip;
using haptics::PinRequest;
using haptics::Pointer;
using haptics::PointerPose;
using haptics::TouchRequest;

enum class ClockKind {
  kRealtime,  ///< simulation time follows the wall clock
  kLockstep,  ///< simulation time advances by step commands only
};

struct SimulationSettings {
  double physics_hz{1000.0};  ///< steps per second of simulation time, > 0
  int haptic_ticks{1};        ///< of the devices in each step, > 0; 1: they are a part of the step
  double pose_hz{60.0};       ///< poses per second of simulation time, in (0, physics_hz]
  ClockKind clock{ClockKind::kRealtime};
};

/// What one `set` command changes; what is left out stays.
struct HandSettings {
  int pointer{0};
  std::optional<double> scale{};               ///< haptics::kMinScale to kMaxScale
  std::optional<double> power_scale{};         ///< haptics::kMinPowerScale to kMaxPowerScale
  std::optional<bool> clutch{};                ///< held
  std::optional<PointerPose> base{};           ///< X_WD of the pointer's device; needs a pointer without a tool
  std::optional<bool> magnet{};                ///< needs a pointer that touches
  std::optional<bool> holds_rotation{};        ///< needs a pointer that grabs
  std::optional<double> angular_stiffness{};   ///< with holds_rotation [N m/rad], > 0; default: see Hands::grab
  std::optional<double> softness{};            ///< 0 to haptics::kMaxSoftness
  std::vector<int> bones{};                    ///< whose joints softness and joint are for; all joints if empty
  std::optional<doll::JointOverride> joint{};  ///< see doll::changed_joint()
  std::optional<Eigen::Vector3d> gravity{};    ///< [m/s^2]

  [[nodiscard]] bool of_doll() const { return softness || joint || gravity; }
};

/// A change of the doll as a whole.
struct PutBack {
  std::string label;          ///< of what was undone or done
  std::vector<int> released;  ///< pointers whose tools were put away for it
};

/// The doll in its hands (haptics::Hands), the devices that are some of them, and simulation time. Single-threaded;
/// knows no messages. Devices live in the simulation's time with the lockstep clock, and in the wall clock's with the
/// other.
class Simulation {
 public:
  Simulation(doll::Doll doll, const SimulationSettings& settings, haptics::DeviceHands devices = {});

  [[nodiscard]] const doll::Doll& doll() const { return hands_.doll(); }
  [[nodiscard]] const SimulationSettings& settings() const { return settings_; }
  /// The doll's bodies first, as in its definition; then the fingertips that are out.
  [[nodiscard]] const dynamics::State& state() const { return hands_.state(); }
  [[nodiscard]] const haptics::Hands& hands() const { return hands_; }
  [[nodiscard]] const haptics::DeviceHands& devices() const { return devices_; }
  [[nodiscard]] const StepStatistics& statistics() const { return statistics_; }
  [[nodiscard]] const std::map<int, Pointer>& pointers() const { return hands_.pointers(); }
  /// Of the pointers that messages have come for.
  [[nodiscard]] const std::map<int, PointerInput>& inputs() const { return inputs_; }
  [[nodiscard]] std::int64_t steps() const { return steps_; }
  /// Simulation time [us], rounded from the exact steps / physics_hz: it does not drift.
  [[nodiscard]] std::int64_t time_us() const;
  [[nodiscard]] int yielding_joints() const { return yielding_joints_; }
  [[nodiscard]] dynamics::Energy energy() const { return dynamics::energy(hands_.model(), state()); }
  /// The doll is at rest as a whole, and nothing has happened since that could disturb it: steps would change nothing.
  /// Never where there are devices, which want to be read.
  [[nodiscard]] bool resting() const { return resting_; }
  /// So many steps pass in which the resting doll stays as it is.
  void rest(std::int64_t steps);
  /// Why no step is possible any more until reset(), "" if it is.
  [[nodiscard]] const std::string& failure() const { return failure_; }

  /// Takes note of where the hand of pointer `id` is to be. An older message of the same client is ignored.
  /// A pointer with a tool out moves there at constant velocity: with the realtime clock from now on, over the mean
  /// time between its messages (at least a step, at most 50 ms), so that it lags by about one message, a 60 Hz mouse is
  /// no staircase and a burst of messages no blow; with the lockstep clock over the steps of the next begin_motion().
  /// Without further messages it stays there, and keeps its tool, until somebody releases it. What becomes of a message
  /// for a device's pointer: see haptics::DeviceHands.
  void point(int id, const PointerPose& pose, const std::string& client_id, std::int64_t sequence);

  /// Lockstep: the pointers glide to their newest poses over the next `steps` steps, > 0.
  void begin_motion(std::int64_t steps);

  // As those of haptics::Hands.
  Eigen::Vector3d grab(const GrabRequest& request);
  [[nodiscard]] skinning::SkinPoint skin_near(int pointer, double reach) { return hands_.skin_near(pointer, reach); }
  [[nodiscard]] skinning::SkinPoint skin_along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    return hands_.skin_along(origin, direction);
  }
  void touch(const TouchRequest& request);
  void release(int pointer);
  const haptics::Pin& pin(const PinRequest& request);
  void unpin(int id);
  void unpin_all();

  /// All of it or, throwing std::invalid_argument with one line, nothing.
  void set(const HandSettings& settings, const std::string& label);
  /// See haptics::Hands::lock(). Throws if none of the bones has a joint.
  void lock(const std::vector<int>& bones, const std::array<bool, 3>& axes, bool locked, const std::string& label);

  /// The bodies of those of the bones that have a joint; of all bones if none is given. Throws if none has one.
  [[nodiscard]] std::vector<int> joints_of(const std::vector<int>& bones) const;

  /// See haptics::Hands::load_pose(). What comes while joints are driven is a part of that step of the history.
  void load_pose(const haptics::PoseRequest& request);
  void cancel_pose();

  /// The initial pose at rest; all pointers released, all pins gone. Time goes on: time stamps never go back. With
  /// `all` what was set of the doll is as it was made too.
  void reset(bool all = false);

  /// Steps of the history: the work of one tool, from when it comes out until the next step begins, so that the doll's
  /// coming to rest is a part of it; of two that come out together the work of both; and every other change of the
  /// doll. Several `set`s of the same in quick succession, as of a slider, are one.
  [[nodiscard]] const session::History& history() const { return history_; }
  /// The doll as it was before the newest step, or after the next, at rest; tools are put away for it. Throw
  /// std::invalid_argument, one line, if there is none.
  PutBack undo();
  PutBack redo(std::optional<std::size_t> branch);
  /// To any place of the history, of History::place(); where the doll is already, nothing happens.
  PutBack go_to_place(std::int64_t place);
  /// The pose in the mirror, see session::mirrored(); pins hold what they hold where it is then.
  PutBack mirror(session::MirrorSide side, const std::string& label);
  /// At once in this pose and at rest, see session::posed(); pins hold what they hold where it is then.
  PutBack put_pose(std::span<const session::PosedJoint> joints, const std::string& label);
  /// The doll as it was kept. Throws what haptics::Hands::recall() throws.
  PutBack put_back(const haptics::DollMemory& memory, const std::string& label);

  /// With the realtime clock: the devices' ticks, where there are more than one in a step, run on a thread of their own
  /// from now on.
  void start_haptic_thread();
  /// Whether advance() may be called: not while that thread is at the ticks before the step.
  [[nodiscard]] bool ready() const { return devices_.ready(); }

  /// `log` is told what devices bring into each step from now on, when they have been served and before the step
  /// counts.
  void log_devices(std::function<void(const haptics::DeviceInput&)> log) { device_log_ = std::move(log); }

  /// One step. False if it failed, see failure(); the state is then the last good one, and devices push no more.
  bool advance();

  [[nodiscard]] PointerPose held_pose(const Grip& grip) const { return hands_.held_pose(grip); }

 private:
  /// A pointer, and which of its tools.
  struct NotedTool {
    int pointer;
    std::int64_t taken;
    bool operator==(const NotedTool&) const = default;
  };

  [[nodiscard]] double time() const { return static_cast<double>(steps_) / settings_.physics_hz; }
  [[nodiscard]] double device_time() const;
  template <class Action>
  void edit(const std::string& label, Action&& action);
  [[nodiscard]] bool is_soon_after(std::int64_t step) const;
  [[nodiscard]] bool is_noted(int id, const Pointer& pointer) const;
  void note_present_tools();
  void note_tools();
  void recall(const haptics::DollMemory& memory);

  SimulationSettings settings_;
  haptics::Hands hands_;
  haptics::DeviceHands devices_;
  std::function<void(const haptics::DeviceInput&)> device_log_;  ///< may be null
  std::map<int, PointerInput> inputs_;
  StepStatistics statistics_;
  session::History history_;
  std::vector<NotedTool> tools_;  ///< that are out, as last noted
  std::int64_t set_at_{0};        ///< step before which the newest `set` came
  std::int64_t tool_at_{0};       ///< step before which the newest tool came out that began a step of the history
  std::int64_t steps_{0};
  int yielding_joints_{0};
  bool resting_{false};
  std::string failure_;
};

}  // namespace layfigure::app
