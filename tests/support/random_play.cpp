#include "random_play.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "layfigure/device/open.h"
#include "layfigure/haptics/device_hands.h"

namespace layfigure::testing {
namespace {

using Eigen::Vector3d;
using haptics::Hands;
using haptics::Tool;

constexpr unsigned kSeed = 20261128;
constexpr int kHands = 2;
constexpr double kReach = 0.05;  // [m] about a body's com that fingertips come from
constexpr double kPull = 0.2;    // [m] at most
// The hands feel the doll as that much stiffer and heavier than usual: so that the devices' limits are met.
constexpr double kPower = 10.0;
constexpr double kPatience = 100.0;  // times as long as they are to be on it at once: they are for a tenth of the time

/// Passes on what it is told, and keeps the largest.
class WatchedDriver : public device::Driver {
 public:
  WatchedDriver(std::unique_ptr<device::Driver> driver, double tick, Play& play)
      : driver_(std::move(driver)), limits_(device::GuardSettings::of(driver_->info())), tick_(tick), play_(play) {}
  [[nodiscard]] const device::Info& info() const noexcept override { return driver_->info(); }
  [[nodiscard]] device::Reading read(double time) noexcept override { return driver_->read(time); }
  void write(const device::Wrench& wrench) noexcept override {
    play_.force = std::max(play_.force, wrench.force.norm() / limits_.max_force);
    play_.torque = std::max(play_.torque, wrench.torque.norm() / limits_.max_torque);
    const double growth = wrench.force.norm() - last_.force.norm();
    play_.rise = std::max(play_.rise, growth / (limits_.force_rate * tick_));
    if (!wrench.is_finite()) ++play_.failures;
    last_ = wrench;
    driver_->write(wrench);
  }
  [[nodiscard]] device::Wrench exerted() const noexcept override { return driver_->exerted(); }
  void close() noexcept override { driver_->close(); }
  void aim(const Vector3d& position, const Eigen::Quaterniond& rotation) noexcept override {
    driver_->aim(position, rotation);
  }

 private:
  std::unique_ptr<device::Driver> driver_;
  device::GuardSettings limits_;
  double tick_;
  Play& play_;
  device::Wrench last_;
};

class Player {
 public:
  Player(doll::Doll doll, double physics_hz, int ticks, Play& play)
      : play_(play), hands_(std::move(doll), 1.0 / physics_hz), h_(1.0 / physics_hz), random_(kSeed) {
    std::vector<device::Device> devices;
    for (int k = 0; k < kHands; ++k) {
      auto driver = device::open_driver({.kind = "spidar-g6x3", .index = k});
      devices.emplace_back(std::make_unique<WatchedDriver>(std::move(driver), h_ / ticks, play));
    }
    devices_ = haptics::DeviceHands(std::move(devices));
    devices_.place_around(hands_);
    devices_.serve(ticks, h_ / ticks, hands_);
    for (int k = 0; k < kHands; ++k) {
      hands_.set_power_scale(k, kPower * hands_.pointers().at(k).map().power_scale());
    }
    for (int k = 0; k < kHands; ++k) next_[k] = 0.6 + 0.1 * k;  // the guards let forces through by then
  }

  void step() {
    for (int k = 0; k < kHands; ++k) {
      if (time_ >= next_[k]) act(k);
    }
    devices_.begin_step(time_, hands_);
    const bool sound = hands_.step().status == dynamics::StepStatus::kOk;
    if (sound) devices_.end_step(time_, hands_);
    if (!sound || !hands_.state().bodies[0].position.allFinite()) ++play_.failures;
    time_ += h_;
    observe();
  }
  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] double lowest_hand_over() const { return devices_.ledger().lowest; }

 private:
  [[nodiscard]] double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  [[nodiscard]] Vector3d direction() {
    return Vector3d(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)).normalized();
  }
  [[nodiscard]] Vector3d middle_of(int body) {
    dynamics::world_poses(hands_.model(), hands_.state(), poses_);
    return poses_[body].com;
  }

  /// A hand with a tool moves it or puts it away; one without takes one out.
  void act(int k) {
    const double duration = between(0.2, 1.2);
    next_[k] = time_ + duration;
    const Tool tool = hands_.pointers().at(k).tool();
    if (tool != Tool::kNone && between(0.0, 1.0) < 0.3) {
      hands_.release(k);
    } else if (tool == Tool::kGrab) {
      glide(k, start_[k] + between(0.0, kPull) * direction(), duration);
    } else if (tool == Tool::kTouch) {
      glide(k,
            middle_of(body_[k]) + between(-1.0, 1.0) * (start_[k] - middle_of(body_[k])) + kReach * 0.5 * direction(),
            duration);
    } else {
      take_tool(k);
    }
  }

  void take_tool(int k) {
    body_[k] = std::uniform_int_distribution<int>(0, bodies_ - 1)(random_);
    const bool grabs = between(0.0, 1.0) < 0.4;
    start_[k] = middle_of(body_[k]) + (grabs ? 0.0 : kReach) * direction();
    devices_.guide(k, {.position = start_[k]}, hands_);
    try {
      if (grabs) {
        hands_.grab({.pointer = k, .bone = hands_.bone_of(body_[k])});
        ++play_.grabs;
      } else {
        hands_.touch({.pointer = k});
      }
    } catch (const std::invalid_argument&) {
      // Inside something: another place next time.
    }
  }

  void glide(int k, const Vector3d& goal, double duration) {
    devices_.guide(k, {.position = goal}, hands_);
    devices_.glide(k, std::max(1L, std::lround(duration / h_)));
  }

  void observe() {
    int busy = 0;
    for (int k = 0; k < kHands; ++k) {
      const haptics::Pointer& pointer = hands_.pointers().at(k);
      const auto& fingertip = pointer.fingertip();
      const bool touches = fingertip && fingertip->touched.contact;
      if (touches && !touched_[k]) ++play_.contacts;
      touched_[k] = touches;
      if (touches || pointer.tool() == Tool::kGrab) ++busy;
    }
    if (busy == kHands) play_.together += h_;
  }

  Play& play_;
  Hands hands_;
  haptics::DeviceHands devices_;
  double h_;
  double time_{0.0};
  std::mt19937 random_;
  int bodies_{static_cast<int>(hands_.doll().definition.bodies.size())};
  std::vector<dynamics::BodyPose> poses_;
  double next_[kHands]{};
  int body_[kHands]{};
  bool touched_[kHands]{};
  Vector3d start_[kHands];
};

}  // namespace

Play play_at_random(doll::Doll doll, double together, double physics_hz, int ticks) {
  Play play;
  Player player(std::move(doll), physics_hz, ticks, play);
  while (play.together < together && player.time() < kPatience * together) player.step();
  play.duration = player.time();
  play.lowest_hand_over = player.lowest_hand_over();
  return play;
}

}  // namespace layfigure::testing
