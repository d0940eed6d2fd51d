#include "layfigure/device/guard.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace layfigure::device {
namespace {

constexpr double kRiseFromNone = 5e-3;   // [s]
constexpr double kUnitTolerance = 1e-3;  // of a quaternion's length: a device may compute in single precision
// A pose that moves by less stays the same: less than a count of any encoder makes of it, more than rounding does.
constexpr double kSameWay = 1e-7;           // [m]
constexpr double kSameTurn = 1e-6;          // [rad]
constexpr double kShortestInterval = 1e-3;  // [s]: two readings in one burst are no jump

void require(double value, const char* name, bool may_be_zero) {
  if (std::isfinite(value) && (value > 0.0 || (may_be_zero && value == 0.0))) return;
  throw std::invalid_argument(std::string("device guard: ") + name + " = " + std::to_string(value) + ", expected " +
                              (may_be_zero ? "0 or more" : "above 0"));
}

bool is_pose(const Reading& reading) {
  return reading.position.allFinite() && reading.rotation.coeffs().allFinite() &&
         std::abs(reading.rotation.norm() - 1.0) <= kUnitTolerance;
}

Wrench scaled(const Wrench& wrench, double s) { return {.force = s * wrench.force, .torque = s * wrench.torque}; }

}  // namespace

std::string_view fault_name(Fault fault) {
  switch (fault) {
    case Fault::kNone:
      return "none";
    case Fault::kNotStarted:
      return "no pose yet";
    case Fault::kSilent:
      return "silent";
    case Fault::kGone:
      return "gone";
    case Fault::kInvalid:
      return "pose rejected by the device";
    case Fault::kNotFinite:
      return "pose not finite";
    case Fault::kJump:
      return "pose jumped";
    case Fault::kFrozen:
      return "pose does not change";
    case Fault::kBadWrench:
      return "wrench not finite";
    case Fault::kLate:
      return "tick late";
    case Fault::kStalled:
      return "simulation late";
    case Fault::kClosed:
      return "closed";
  }
  return "?";
}

GuardSettings GuardSettings::of(const Info& info) {
  return {.max_force = info.max_force,
          .max_torque = info.max_torque,
          .force_rate = info.max_force / kRiseFromNone,
          .torque_rate = info.max_torque / kRiseFromNone,
          .still_time = info.simulated ? std::numeric_limits<double>::infinity() : GuardSettings::kStillTime};
}

void GuardSettings::validate() const {
  require(max_force, "max_force", true);
  require(max_torque, "max_torque", true);
  require(force_rate, "force_rate", true);
  require(torque_rate, "torque_rate", true);
  require(patience, "patience", false);
  require(fade, "fade", false);
  require(max_speed, "max_speed", false);
  require(max_spin, "max_spin", false);
  require(quiet_time, "quiet_time", true);
  require(rise_time, "rise_time", false);
  if (!(still_time > 0.0)) require(still_time, "still_time", false);
  require(still_fade, "still_fade", false);
}

Guard::Guard(const GuardSettings& settings) : settings_(settings) { settings.validate(); }

double Guard::advance(double time) noexcept {
  if (!started_ && std::isfinite(time)) {
    started_ = true;
    now_ = last_good_ = quiet_since_ = time;
  }
  if (time > now_ && std::isfinite(time)) now_ = time;
  return now_;
}

/// A fault that lasts keeps its beginning; another one beside it does not put off the fading.
void Guard::trip(Fault fault, double since) noexcept {
  quiet_since_ = now_;
  if (report_.fault == Fault::kClosed) return;
  if (report_.fault == Fault::kNone) {
    fault_since_ = since;
    at_fault_ = exerted_;
    ++report_.trips;
  }
  report_.fault = fault;
  report_.last_fault = fault;
  report_.share = risen_share_ = 0.0;
}

Fault Guard::fault_of(double time, const Reading& reading) noexcept {
  if (reading.status == Reading::Status::kGone) return Fault::kGone;
  if (reading.status == Reading::Status::kInvalid) return Fault::kInvalid;
  if (!is_pose(reading)) return Fault::kNotFinite;
  const bool had = has_finite_;
  const Reading before = last_finite_;
  const double interval = std::max(time - last_finite_time_, kShortestInterval);
  last_finite_ = reading;
  last_finite_.rotation.normalize();
  last_finite_time_ = time;
  has_finite_ = true;
  if (!had) return Fault::kNone;
  const bool jumped = (reading.position - before.position).norm() > settings_.max_speed * interval ||
                      last_finite_.rotation.angularDistance(before.rotation) > settings_.max_spin * interval;
  return jumped ? Fault::kJump : Fault::kNone;
}

Reading Guard::check(double time, const Reading& reading) noexcept {
  const double now = advance(time);
  Reading answer = trusted_;
  answer.status = reading.status;
  if (reading.status == Reading::Status::kNothingNew) return answer;
  const Fault fault = fault_of(now, reading);
  if (fault != Fault::kNone) {
    trip(fault, now);
    if (reading.status == Reading::Status::kOk) answer.status = Reading::Status::kInvalid;
    return answer;
  }
  last_good_ = now;
  watch_stillness(last_finite_);
  const bool waits = report_.fault == Fault::kJump && now - quiet_since_ < settings_.quiet_time;
  if (waits) {
    answer.status = Reading::Status::kInvalid;
    return answer;
  }
  trusted_ = last_finite_;
  trusted_.grip = std::isfinite(reading.grip) ? std::clamp(reading.grip, 0.0, 1.0) : 0.0;
  return trusted_;
}

void Guard::watch_stillness(const Reading& reading) noexcept {
  const bool same = (reading.position - still_.position).norm() <= kSameWay &&
                    reading.rotation.angularDistance(still_.rotation) <= kSameTurn;
  if (same) return;
  still_ = reading;
  still_since_ = now_;
}

/// A push under which nothing moves falls; one that moves something comes back.
void Guard::judge_stillness(double elapsed, const Wrench& wanted) noexcept {
  if (report_.fault == Fault::kFrozen && still_since_ < fault_since_) return trip(Fault::kFrozen, now_);
  const bool pushes = std::min(wanted.force.norm(), settings_.max_force) >= kNoticedForce ||
                      std::min(wanted.torque.norm(), settings_.max_torque) >= kNoticedTorque;
  if (report_.fault != Fault::kNone) still_share_ = 1.0;
  if (!pushes || report_.fault != Fault::kNone) still_since_ = now_;
  const bool falls = now_ - still_since_ > settings_.still_time;
  const double change = falls ? -elapsed / settings_.still_fade : elapsed / settings_.rise_time;
  still_share_ = std::clamp(still_share_ + change, 0.0, 1.0);
  if (still_share_ == 0.0) trip(Fault::kFrozen, now_);
}

void Guard::recover(double time) noexcept {
  if (report_.fault == Fault::kNone || report_.fault == Fault::kClosed) return;
  const bool has_pose = has_finite_ && time - last_good_ <= settings_.patience;
  if (has_pose && time - quiet_since_ >= settings_.quiet_time) report_.fault = Fault::kNone;
}

Wrench Guard::faded(double time) const noexcept {
  const double left = 1.0 - (time - fault_since_) / settings_.fade;
  return left > 0.0 ? scaled(at_fault_, left) : Wrench{};
}

Wrench Guard::bounded(double elapsed, const Wrench& wanted) const noexcept {
  Wrench bound{.force = shortened(wanted.force, settings_.max_force),
               .torque = shortened(wanted.torque, settings_.max_torque)};
  bound.force = exerted_.force + shortened(bound.force - exerted_.force, settings_.force_rate * elapsed);
  bound.torque = exerted_.torque + shortened(bound.torque - exerted_.torque, settings_.torque_rate * elapsed);
  return bound;
}

Wrench Guard::limit(double time, const Wrench& wanted) noexcept {
  const double now = advance(time);
  const double elapsed = has_limited_ ? now - last_limit_ : 0.0;
  const double last = has_limited_ ? last_limit_ : now;
  last_limit_ = now;
  has_limited_ = true;
  if (!wanted.is_finite()) trip(Fault::kBadWrench, now);
  if (elapsed > settings_.patience) trip(Fault::kLate, last + settings_.patience);
  if (has_finite_ && now - last_good_ > settings_.patience) {
    // What is known of a fault that keeps good readings away says more.
    const bool explained = report_.fault != Fault::kNone && report_.fault != Fault::kSilent;
    trip(explained ? report_.fault : Fault::kSilent, last_good_ + settings_.patience);
  }
  judge_stillness(elapsed, wanted);
  recover(now);
  if (report_.fault == Fault::kClosed) {
    exerted_ = {};
  } else if (report_.fault != Fault::kNone) {
    exerted_ = faded(now);
  } else {
    risen_share_ = std::min(1.0, risen_share_ + elapsed / settings_.rise_time);
    report_.share = risen_share_ * still_share_;
    exerted_ = bounded(elapsed, scaled(wanted, report_.share));
  }
  return exerted_;
}

void Guard::close() noexcept {
  trip(Fault::kClosed, now_);
  report_.fault = Fault::kClosed;
  exerted_ = {};
}

}  // namespace layfigure::device
