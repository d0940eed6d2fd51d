#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "layfigure/device/device.h"
#include "layfigure/haptics/device_input.h"
#include "layfigure/haptics/device_set.h"
#include "layfigure/haptics/glide.h"
#include "layfigure/haptics/hands.h"
#include "layfigure/haptics/haptic_loop.h"
#include "layfigure/haptics/realtime_thread.h"
#include "layfigure/haptics/tick_record.h"

namespace layfigure::haptics {

/// The stiffness of which a grip or fingertip is felt unless told otherwise [N/m]: a third of what an ideal wall may
/// have at 1 kHz with a SPIDAR's encoders, and with the forces of a few newtons that it has as large as a few
/// millimetres.
inline constexpr double kFeltStiffness = 1000.0;

/// Haptic devices as hands: device k moves pointer k, and feels what that exerts.
///
/// Devices are read and written once in a step of the doll, which is solved with their couplings; or at a higher rate,
/// by a HapticLoop on the caller's thread or on one of its own, with steps between.
///
/// At first a pointer stands where the doll's middle is, two of them side by side, its translation scale such that the
/// grip's reach covers the doll. The power scale is such that a grip of the default stiffness k is felt with
/// kFeltStiffness, P s^2 k: a small doll's forces are made larger, a large one's smaller, so that both can be felt and
/// rendered. `set` changes all of it.
///
/// A device that tells how its grip is squeezed, or has buttons, needs nothing else: squeezing (or the first button)
/// grabs the skin that is near, opening lets go; the second button is the clutch.
///
/// A client's messages for such a pointer: while it has no tool they place it, wherever the grip is. With a tool out
/// they tell a simulated device where its hand wants to be; a real one has a hand of its own. A simulated hand that was
/// placed keeps the pointer there, its clutch held so to say, and goes back to the middle of its workspace, until a
/// tool comes out.
///
/// In place of devices there may be what they brought into each step of an earlier session: then none is opened, and
/// the steps are the same.
///
/// For the thread that steps the doll. begin_step(), end_step() and let_go() allocate, lock, log and throw nothing, but
/// for what Hands::make_local_model() allocates where there is more than ever before.
class DeviceHands {
 public:
  DeviceHands() = default;
  explicit DeviceHands(std::vector<device::Device> devices, const PassivityOptions& passivity = {});
  /// As devices of these kinds brought it: `next` is called once in each step, before it, and may throw.
  DeviceHands(std::vector<device::Info> infos, std::function<DeviceInput()> next);

  /// Sets the maps of the pointers as said above. Once, before the first step.
  void place_around(Hands& hands) const;
  /// The devices are served in `ticks` > 1 ticks of length `tick` [s] in each step of the doll from now on. Once,
  /// before the first step; at most kMostPointers devices.
  void serve(int ticks, double tick, Hands& hands);
  /// The ticks run on a thread of their own from now on, by the wall clock. Once, after serve().
  void start_thread(Hands& hands);

  [[nodiscard]] bool empty() const { return hands_.empty(); }
  [[nodiscard]] int count() const { return static_cast<int>(hands_.size()); }
  [[nodiscard]] bool drives(int pointer) const { return pointer >= 0 && pointer < count(); }
  [[nodiscard]] const device::Info& info(int index) const { return infos_[index]; }
  /// As it was after the last step.
  [[nodiscard]] const DeviceSeen& seen(int index) const { return hands_[index].seen; }
  /// Ticks of a step; 1: the devices are served once in a step.
  [[nodiscard]] int ticks() const { return ticks_; }
  /// What the ticks' thread was granted; null: it has none.
  [[nodiscard]] const RealtimeGrant* grant() const { return thread_ ? &thread_->grant() : nullptr; }
  /// Of the ticks between steps. Needs serve().
  [[nodiscard]] const HandOverLedger& ledger() const { return report_->ledger; }
  /// What the newest step began with.
  [[nodiscard]] const DeviceInput& input() const { return input_; }
  /// How long ticks took; the step is in them where there is one in each.
  [[nodiscard]] const TickWindow& tick_window() const { return window_; }

  /// Whether a step may be made: not while the thread is at its ticks, ...
  [[nodiscard]] bool ready() const { return !thread_ || loop_->has_report(); }
  /// ... until this time, by the monotonic clock [s]. Needs start_thread().
  [[nodiscard]] double ready_at() const { return report_->next; }

  /// A client's wish for where pointer `pointer`, which drives() says is a device's, is to be.
  void guide(int pointer, const PointerPose& world, Hands& hands);
  /// The simulated hand of the pointer, or of all, glides to where it was guided over the next `steps` steps, > 0.
  void glide(int pointer, std::int64_t steps);
  void glide(std::int64_t steps);

  /// What squeezing and buttons ask for. Before begin_step(); allocates where it grabs.
  void follow_buttons(Hands& hands);
  /// Reads the devices and moves their pointers; runs the step's ticks, or takes over what the thread's have done.
  /// `time` [s]: see device::Driver. Needs ready().
  void begin_step(double time, Hands& hands);
  /// Exerts on the hands what the step has told, or tells the thread.
  void end_step(double time, Hands& hands);
  /// Exerts nothing: there was no step.
  void let_go(double time);

 private:
  struct Hand {
    DeviceSeen seen;
    PointerPose wanted;  ///< by a simulated hand, in the device's frame ...
    PointerPose guided;  ///< ... and where it is led to
    Glide glide;
    std::optional<PointerPose> placed;  ///< a simulated hand's pointer, until a tool comes out
    bool squeezed{false};
    bool clutched{false};
  };

  [[nodiscard]] bool is_served() const { return ticks_ > 1; }
  [[nodiscard]] bool is_replayed() const { return next_ != nullptr; }
  void read(double time);
  void note_hands();
  void move_pointers(Hands& hands);
  void give(Hands& hands);
  void run_ticks(double time);
  void collect(double time);
  void recall_report();
  void record_tick(double time, double step);

  std::vector<Hand> hands_;
  std::vector<device::Info> infos_;
  std::function<DeviceInput()> next_;  ///< null: there are devices
  DeviceInput input_;
  int ticks_{1};      ///< of a step
  double tick_{0.0};  ///< length [s] of one of several
  bool threaded_{false};
  std::unique_ptr<DeviceSet> devices_;  ///< null: none, or they are replayed
  std::unique_ptr<HapticLoop> loop_;    ///< null: once in a step, or they are replayed
  std::unique_ptr<HapticOrders> orders_;
  std::unique_ptr<HapticReport> report_;
  TickRecord record_;  ///< where there is one tick in a step
  std::int64_t begun_ns_{0};
  double last_time_{0.0};
  TickWindow window_;
  std::unique_ptr<RealtimeThread> thread_;  ///< last: it ends first
};

}  // namespace layfigure::haptics
