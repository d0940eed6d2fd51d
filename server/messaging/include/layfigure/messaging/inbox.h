#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "layfigure/messaging/codec.h"

namespace layfigure::messaging {

/// What clients sent, handed from the bus's receive thread to the simulation's thread in order of arrival. Commands
/// queue without loss. A pointer message replaces an older one of the same pointer (newest wins) unless a command came
/// in between, so that a script's "point there, grab, point here" keeps its meaning however fast it arrives.
///
/// A message that cannot be used is counted and logged at most once a second. All members are thread-safe.
class Inbox {
 public:
  using Event = std::variant<pointer_t, command_t>;
  using Clock = std::chrono::steady_clock;

  /// Decodes and queues a message.
  void receive_pointer(ByteView bytes);
  void receive_command(ByteView bytes);

  /// Everything that has arrived since the last call, oldest first.
  [[nodiscard]] std::vector<Event> take();

  /// Returns at `deadline`, or sooner when something is there to take or interrupt() was called.
  void wait_until(Clock::time_point deadline);

  /// Ends the wait at hand, or the next one.
  void interrupt();

  /// Messages refused so far: not decodable, wrong version, out of range, beyond what can be queued.
  [[nodiscard]] std::int64_t bad_messages() const { return bad_messages_; }

 private:
  void refuse(std::string_view kind, const std::string& problem);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Event> events_;
  bool interrupted_{false};
  std::atomic<std::int64_t> bad_messages_{0};
  Clock::time_point next_log_{};
};

}  // namespace layfigure::messaging
