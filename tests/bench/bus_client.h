#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <layfigure/character_t.hpp>
#include <layfigure/reply_t.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "layfigure/messaging/bus.h"

namespace layfigure::bench {

using Clock = std::chrono::steady_clock;

/// When a pose came.
struct PoseArrival {
  std::int64_t sequence;
  std::int64_t time_us;  ///< simulation time
  Clock::time_point at;
};

/// A client of a server as programs of other people are: it hears all poses, and holds the doll by a pointer.
class BusClient {
 public:
  /// Each pose keeps the receiving thread for `busy`: a slow subscriber.
  explicit BusClient(const std::string& url, std::chrono::milliseconds busy = {});

  /// Holds the character's last body with pointer 0; returns where, world [m]. Throws std::runtime_error.
  std::array<double, 3> grab();
  /// Moves pointer 0 to there; returns when it was sent.
  Clock::time_point point(const std::array<double, 3>& position);
  /// When the first pose came that contains an effect of the newest point(): one of a step before which the pointer had
  /// begun to move. None within a second.
  [[nodiscard]] std::optional<Clock::time_point> wait_for_effect();
  /// All poses so far.
  [[nodiscard]] std::vector<PoseArrival> arrivals();

 private:
  void receive_pose(messaging::ByteView bytes);
  void receive_force(messaging::ByteView bytes);
  reply_t command(const std::string& name, const std::string& bone);

  std::chrono::milliseconds busy_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<PoseArrival> arrivals_;
  std::optional<character_t> character_;
  std::optional<reply_t> reply_;
  std::array<double, 3> target_{};
  bool awaits_effect_{false};
  std::optional<Clock::time_point> effect_;
  std::string id_;
  std::int64_t command_sequence_{0};
  std::int64_t pointer_sequence_{0};
  std::unique_ptr<messaging::Bus> bus_;  // last: its thread uses the others
};

/// A subscriber to everything that has stopped to read.
class StoppedSubscriber {
 public:
  /// `url` is a broker's. Throws std::runtime_error if it cannot be reached.
  explicit StoppedSubscriber(const std::string& url);
  ~StoppedSubscriber();
  StoppedSubscriber(const StoppedSubscriber&) = delete;
  StoppedSubscriber& operator=(const StoppedSubscriber&) = delete;

 private:
  int socket_;
};

}  // namespace layfigure::bench
