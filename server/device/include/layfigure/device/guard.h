#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "layfigure/device/types.h"

namespace layfigure::device {

/// Why there is no force.
enum class Fault {
  kNone,
  kNotStarted,  ///< no pose was read yet
  kSilent,      ///< no new reading for too long
  kGone,        ///< the device says that it is not there
  kInvalid,     ///< the device rejects its own pose: slack, slip, a broken string, a wrong calibration
  kNotFinite,   ///< of the pose or its quaternion
  kJump,        ///< the pose is further from the last than any hand moves
  kFrozen,      ///< the pose stays as it is to the last digit, whatever the hand is pushed with
  kBadWrench,   ///< the wrench asked for is not finite
  kLate,        ///< the tick came too late
  kStalled,     ///< whoever computes the wrench has not heard of the doll for too long
  kClosed,      ///< for good
};

/// One word or two for reports.
[[nodiscard]] std::string_view fault_name(Fault fault);

struct GuardSettings {
  double max_force{0.0};    ///< [N]
  double max_torque{0.0};   ///< [N m]
  double force_rate{0.0};   ///< [N/s]
  double torque_rate{0.0};  ///< [N m/s]
  double patience{4e-3};    ///< without a new reading, or between two ticks, until it is a fault [s] ...
  double fade{4e-3};        ///< ... and from there, or from any other fault, to no force [s]: 8 ms in all
  double max_speed{10.0};   ///< of a hand's grip [m/s]
  double max_spin{100.0};   ///< [rad/s]
  double quiet_time{0.05};  ///< of good readings and wrenches before a force comes back [s] ...
  double rise_time{0.5};    ///< ... and for it to come back fully [s]
  double still_time{std::numeric_limits<double>::infinity()};  ///< of a pose that stays the same under a push until the
                                                               ///< push falls [s] ...
  double still_fade{0.5};                                      ///< ... and from there to none [s]

  /// A hand's tremor is of 8 Hz and more [s].
  static constexpr double kStillTime = 0.25;

  /// What the device can do, reached from none within 5 ms: faster than a fast hand that meets a stiff wall needs it.
  /// Stillness is watched for kStillTime, but not of a simulated device, whose hand has no tremor.
  [[nodiscard]] static GuardSettings of(const Info& info);
  /// Throws std::invalid_argument that names the value and its range.
  void validate() const;
};

/// A push that moves a hand for sure: more than the friction of a SPIDAR's eight pulleys [N]; and the torque that this
/// is at its grip's rim [N m].
inline constexpr double kNoticedForce = 0.5;
inline constexpr double kNoticedTorque = 0.015;

struct GuardReport {
  Fault fault{Fault::kNotStarted};  ///< at present
  Fault last_fault{Fault::kNone};   ///< the newest that there was after the start
  double share{0.0};                ///< of the force that is let through: 0 none .. 1 all
  std::int64_t trips{0};            ///< faults since the start
};

/// Stands between a device and whoever asks for forces. Forces and torques are limited in size and in rate. Whatever
/// goes wrong takes the force to zero within patience + fade (8 ms) of the last moment at which all was well:
///     share(t) falls linearly from what was exerted then, to zero within `fade`;
/// after `quiet_time` without a fault it rises again linearly, within `rise_time`.
///
/// Poses that stand still may be those of a hand that does, or of a device that repeats itself. What tells them apart
/// is that a hand trembles, and gives way: the stiffest, some kN/m, by a count of the encoders for every few hundredths
/// of a newton. So a push of kNoticedForce or kNoticedTorque under which the pose has not changed at all for
/// `still_time` falls linearly, within `still_fade`. A hand moves before the push has lost what friction takes, and
/// gets it back; a frozen device does not, and pushes no more until its pose changes (Fault::kFrozen). Smaller pushes,
/// which friction may hide, are not watched.
///
/// Pure: knows no clock but the times that it is given. A time that is not finite, or before the last, counts as the
/// last. For one thread; allocates nothing.
class Guard {
 public:
  /// Throws std::invalid_argument.
  explicit Guard(const GuardSettings& settings);

  /// What to make of a reading: itself, its quaternion normalised, if it can be believed; else the last that could, and
  /// its status why not. A jump is measured from the last finite reading, so that a device that is really elsewhere is
  /// believed again after quiet_time.
  [[nodiscard]] Reading check(double time, const Reading& reading) noexcept;

  /// What to exert.
  [[nodiscard]] Wrench limit(double time, const Wrench& wanted) noexcept;

  /// A fault that only the caller knows of, now; it lasts as long as this is called.
  void fail(Fault fault) noexcept { trip(fault, now_); }

  /// No force from now on; the next limit() says so.
  void close() noexcept;

  [[nodiscard]] const GuardReport& report() const noexcept { return report_; }

 private:
  void trip(Fault fault, double since) noexcept;
  [[nodiscard]] double advance(double time) noexcept;
  [[nodiscard]] Fault fault_of(double time, const Reading& reading) noexcept;
  void recover(double time) noexcept;
  void watch_stillness(const Reading& reading) noexcept;
  void judge_stillness(double elapsed, const Wrench& wanted) noexcept;
  [[nodiscard]] Wrench faded(double time) const noexcept;
  [[nodiscard]] Wrench bounded(double elapsed, const Wrench& wanted) const noexcept;

  GuardSettings settings_;
  GuardReport report_;
  double now_{0.0};
  bool started_{false};     ///< a time is known
  double last_limit_{0.0};  ///< time of the last limit()
  bool has_limited_{false};
  double last_good_{0.0};  ///< time of the last reading that could be believed
  double fault_since_{0.0};
  double quiet_since_{0.0};  ///< time of the last sign of a fault
  Reading trusted_;
  Reading last_finite_;  ///< whatever it was
  double last_finite_time_{0.0};
  bool has_finite_{false};
  Reading still_;            ///< that the poses since have not moved from ...
  double still_since_{0.0};  ///< ... under a push
  double still_share_{1.0};  ///< of the push that is let through for it ...
  double risen_share_{0.0};  ///< ... and for the time since a fault
  Wrench exerted_;
  Wrench at_fault_;  ///< what was exerted when it began
};

}  // namespace layfigure::device
