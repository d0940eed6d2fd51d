#include "layfigure/device/check.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>
#include <thread>
#include <vector>

namespace layfigure::device {
namespace {

using Clock = std::chrono::steady_clock;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLongestCall = 200e-6;  // [s] of read() and write() together: a fifth of a tick at 1 kHz
constexpr double kUnitTolerance = 1e-3;  // as of the guard
constexpr double kReachTolerance = 4.0;  // a pose so many times beyond what the device says is none
constexpr double kForceTolerance = 1.2;  // of a simulated device's friction and lag
constexpr double kNoForce = 0.05;        // of the largest: what counts as none
constexpr int kPushes = 20;              // ticks that a force is waited for: longer than any motor's lag
constexpr int kKnocks = 5;               // ticks of a wrench that is not fit: short, it may be as large as can be
constexpr int kRest = 50;                // ticks to come to rest in

std::string number(double value, const char* unit) {
  std::ostringstream text;
  text.precision(3);
  text << value << ' ' << unit;
  return text.str();
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Ticks of the caller, on the wall clock or, for a simulated device, as fast as they can be computed.
class Ticker {
 public:
  Ticker(Driver& driver, double tick) : driver_(driver), tick_(tick) {}

  /// Writes `wrench`, waits for the next tick, reads.
  Reading tick(const Wrench& wrench) {
    const Clock::time_point begin = Clock::now();
    driver_.write(wrench);
    const Clock::duration writing = Clock::now() - begin;
    time_ += tick_;
    if (!driver_.info().simulated) {
      std::this_thread::sleep_until(start_ + std::chrono::duration_cast<Clock::duration>(ticks(time_)));
      time_ = std::max(time_, ticks(Clock::now() - start_).count());
    }
    const Clock::time_point middle = Clock::now();
    const Reading reading = driver_.read(time_);
    calls_.push_back(ticks(Clock::now() - middle + writing).count());
    return reading;
  }

  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] const std::vector<double>& calls() const { return calls_; }

 private:
  using ticks = std::chrono::duration<double>;

  Driver& driver_;
  double tick_;
  double time_{0.0};
  Clock::time_point start_{Clock::now()};
  std::vector<double> calls_;
};

/// What was read over some seconds.
struct Record {
  int readings{0}, fresh{0}, invalid{0}, gone{0};
  bool finite{true}, unit{true}, grip{true};
  double furthest{0.0}, fastest{0.0}, fastest_turn{0.0};
  std::vector<double> gaps;  ///< between new poses [s]
};

class Check {
 public:
  Check(const CheckSettings& settings, const std::function<void(const CheckLine&)>& tell)
      : settings_(settings), tell_(tell) {}

  bool run(const std::function<std::unique_ptr<Driver>()>& open) {
    std::unique_ptr<Driver> driver = open();
    describe(driver->info());
    Ticker ticker(*driver, settings_.tick);
    if (!judge(wait_for_pose(ticker), "a pose comes", "within " + number(settings_.seconds, "s"))) return false;
    judge_readings(driver->info(), record(ticker));
    judge_wrenches(*driver, ticker);
    judge_calls(ticker);
    judge_closing(*driver, ticker);
    driver.reset();
    judge_opening(open);
    return passed_;
  }

 private:
  bool judge(bool holds, std::string what, std::string detail = {}) {
    passed_ = passed_ && holds;
    tell_({holds ? CheckLine::Result::kPassed : CheckLine::Result::kFailed, std::move(what), std::move(detail)});
    return holds;
  }

  void tell(std::string what, std::string detail) {
    tell_({CheckLine::Result::kTold, std::move(what), std::move(detail)});
  }

  void describe(const Info& info) {
    const auto is_amount = [](double x) { return std::isfinite(x) && x >= 0.0; };
    tell("device", info.name + (info.simulated ? ", on its own time" : ""));
    judge(!info.name.empty(), "it has a name");
    judge(is_amount(info.max_force) && is_amount(info.max_torque), "its force and torque are finite",
          number(info.max_force, "N, ") + number(info.max_torque, "N m"));
    judge(is_amount(info.reach) && info.reach > 0.0 && is_amount(info.reach_angle), "its reach is finite",
          number(info.reach, "m, ") + number(info.reach_angle, "rad"));
  }

  bool wait_for_pose(Ticker& ticker) {
    while (ticker.time() < settings_.seconds) {
      if (ticker.tick({}).status == Reading::Status::kOk) return true;
    }
    return false;
  }

  Record record(Ticker& ticker) {
    Record record;
    Reading last;
    double last_time = -1.0;
    const double end = ticker.time() + settings_.seconds;
    while (ticker.time() < end) {
      const Reading reading = ticker.tick({});
      ++record.readings;
      record.invalid += reading.status == Reading::Status::kInvalid ? 1 : 0;
      record.gone += reading.status == Reading::Status::kGone ? 1 : 0;
      if (reading.status != Reading::Status::kOk) continue;
      ++record.fresh;
      look_at(reading, record);
      if (last_time >= 0.0) compare(last, reading, ticker.time() - last_time, record);
      last = reading;
      last_time = ticker.time();
    }
    return record;
  }

  static void look_at(const Reading& reading, Record& record) {
    record.finite = record.finite && reading.position.allFinite() && reading.rotation.coeffs().allFinite();
    record.unit = record.unit && std::abs(reading.rotation.norm() - 1.0) <= kUnitTolerance;
    record.grip = record.grip && reading.grip >= 0.0 && reading.grip <= 1.0;
    record.furthest = std::max(record.furthest, reading.position.norm());
  }

  static void compare(const Reading& last, const Reading& now, double interval, Record& record) {
    record.gaps.push_back(interval);
    record.fastest = std::max(record.fastest, (now.position - last.position).norm() / interval);
    record.fastest_turn = std::max(record.fastest_turn, now.rotation.angularDistance(last.rotation) / interval);
  }

  void judge_readings(const Info& info, const Record& record) {
    const GuardSettings guard = GuardSettings::of(info);
    judge(record.gone == 0, "it stays there", std::to_string(record.gone) + " readings said that it has gone");
    judge(record.invalid == 0, "it rejects none of its poses",
          std::to_string(record.invalid) + " of " + std::to_string(record.readings) + " rejected");
    judge(record.finite, "poses are finite");
    judge(record.unit, "quaternions are unit");
    judge(record.grip, "the grip is from 0 to 1");
    judge(record.furthest <= kReachTolerance * info.reach, "poses are within reach",
          number(record.furthest, "m at most"));
    judge(record.fastest <= guard.max_speed && record.fastest_turn <= guard.max_spin, "nothing jumps",
          number(record.fastest, "m/s, ") + number(record.fastest_turn, "rad/s at most"));
    const double gap = median(record.gaps);
    const std::string jitter = "a new pose each " + number(1e3 * gap, "ms, ") + "99th percentile " +
                               number(1e3 * quantile(record.gaps, 0.99), "ms, ") + "longest " +
                               number(1e3 * quantile(record.gaps, 1.0), "ms");
    if (info.feels_force() || info.feels_torque()) {
      judge(gap > 0.0 && gap <= guard.patience, "poses come often enough for forces",
            jitter + "; the guard waits for " + number(1e3 * guard.patience, "ms"));
    } else {
      tell("rate", jitter);
    }
  }

  /// Whether what it exerts comes to be as `holds` says within some ticks.
  template <class Predicate>
  bool becomes(Driver& driver, Ticker& ticker, const Wrench& wrench, const Predicate& holds) {
    for (int k = 0; k < kPushes; ++k) {
      if (holds(driver.exerted())) return true;
      (void)ticker.tick(wrench);
    }
    return holds(driver.exerted());
  }

  static bool is_none(const Wrench& wrench, const Info& info) {
    return wrench.is_finite() && wrench.force.norm() <= kNoForce * info.max_force &&
           wrench.torque.norm() <= kNoForce * info.max_torque;
  }

  void judge_wrenches(Driver& driver, Ticker& ticker) {
    const Info& info = driver.info();
    const auto none = [&](const Wrench& wrench) { return is_none(wrench, info); };
    if (info.feels_force()) {
      const Wrench push{.force = {0.0, 0.0, 0.5 * info.max_force}};
      const bool pushes = becomes(driver, ticker, push, [&](const Wrench& wrench) {
        return wrench.is_finite() && (wrench.force - push.force).norm() < 0.1 * info.max_force;
      });
      judge(pushes, "it exerts the force asked for", number(push.force.z(), "N"));
    }
    judge(becomes(driver, ticker, {}, none), "it lets go when told to");
    bool bounded = true;
    const auto try_all_axes = [&](double value) {
      for (int axis = 0; axis < 3; ++axis) {
        Wrench wrench;
        wrench.force[axis] = value;
        wrench.torque[axis] = -value;
        for (int k = 0; k < kKnocks; ++k) (void)ticker.tick(wrench);
        const Wrench exerted = driver.exerted();
        bounded = bounded && exerted.is_finite() && exerted.force.norm() <= kForceTolerance * info.max_force &&
                  exerted.torque.norm() <= kForceTolerance * info.max_torque;
        if (!std::isfinite(value)) bounded = bounded && is_none(exerted, info);
        for (int k = 0; k < kRest; ++k) (void)ticker.tick({});
      }
    };
    try_all_axes(kNan);
    try_all_axes(kInfinity);
    judge(bounded, "of a wrench that is not finite it exerts nothing");
    bounded = true;
    try_all_axes(1e300);
    judge(bounded, "of a wrench that is much too large it exerts what it can");
    judge(becomes(driver, ticker, {}, none), "it lets go afterwards");
    bool answers = false;
    for (int k = 0; k < kPushes && !answers; ++k) {
      const Reading reading = ticker.tick({});
      answers = reading.status == Reading::Status::kOk && reading.position.allFinite() &&
                reading.rotation.coeffs().allFinite();
    }
    judge(answers, "it answers with finite poses afterwards");
  }

  void judge_calls(const Ticker& ticker) {
    const double typical = median(ticker.calls());
    judge(typical <= kLongestCall, "calls return at once",
          number(1e6 * typical, "us typically, ") +
              number(1e6 * quantile(ticker.calls(), 0.99), "us at the 99th percentile") + " for read and write");
  }

  void judge_closing(Driver& driver, Ticker& ticker) {
    const Info& info = driver.info();
    for (int k = 0; k < kPushes; ++k) (void)ticker.tick({.force = {0.5 * info.max_force, 0.0, 0.0}});
    driver.close();
    // A simulated device's strings lose their tension as its motors do.
    for (int k = 0; k < kPushes; ++k) (void)driver.read(ticker.time() + (k + 1) * settings_.tick);
    judge(is_none(driver.exerted(), info), "it exerts nothing after close", number(driver.exerted().force.norm(), "N"));
  }

  void judge_opening(const std::function<std::unique_ptr<Driver>()>& open) {
    try {
      std::unique_ptr<Driver> driver = open();
      driver->close();
      judge(true, "it opens again after close");
    } catch (const std::exception& error) {
      judge(false, "it opens again after close", error.what());
    }
  }

  const CheckSettings& settings_;
  const std::function<void(const CheckLine&)>& tell_;
  bool passed_{true};
};

}  // namespace

bool check_device(const std::function<std::unique_ptr<Driver>()>& open, const CheckSettings& settings,
                  const std::function<void(const CheckLine&)>& tell) {
  return Check(settings, tell).run(open);
}

}  // namespace layfigure::device
