#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <variant>
#include <vector>

#include "layfigure/messaging/codec.h"
#include "layfigure/messaging/rate_limit.h"

namespace layfigure::messaging {

/// What clients sent, handed from the bus's receive thread to the simulation's thread in order of arrival. Commands
/// queue without loss. A pointer message replaces an older one of the same pointer (newest wins) unless a command came
/// in between, so that a script's "point there, grab, point here" keeps its meaning however fast it arrives.
///
/// A message that cannot be used is counted and logged at most once a second. So is one that is too much: of a client
/// that sends faster than kMaxMessageRate, or beyond what may wait; a client sends a command again that is not
/// answered. All members are thread-safe.
class Inbox {
 public:
  using Event = std::variant<pointer_t, command_t>;
  using Clock = std::chrono::steady_clock;

  /// Of the server of that id: what is addressed to another is passed over without a word.
  explicit Inbox(std::int64_t server_id) : server_id_(server_id) {}

  /// Decodes and queues a message.
  void receive_pointer(ByteView bytes);
  void receive_command(ByteView bytes);
  /// A heartbeat: of this server itself, or of one that should not be on its bus.
  void receive_status(ByteView bytes);

  /// The other server that was heard on the bus within kRivalSilence, and has not said that it leaves; 0: none.
  [[nodiscard]] std::int64_t rival();

  /// What has arrived, oldest first: all, or the first `most` of it; the rest waits on.
  [[nodiscard]] std::vector<Event> take(std::size_t most = std::numeric_limits<std::size_t>::max());

  /// Returns at `deadline`, or sooner when something is there to take or interrupt() was called.
  void wait_until(Clock::time_point deadline);

  /// Ends the wait at hand, or the next one.
  void interrupt();

  /// Messages refused so far: not decodable, wrong version, out of range, too many, beyond what can be queued.
  [[nodiscard]] std::int64_t bad_messages() const { return bad_messages_; }

 private:
  /// An event, and how many bytes it was on the wire.
  struct Waiting {
    Event event;
    std::size_t bytes;
  };

  void queue_pointer(pointer_t pointer, std::size_t bytes);
  /// Empty, or why there is no room for the command.
  [[nodiscard]] std::string queue_command(command_t command, std::size_t bytes);
  /// Empty, or that the client sends too fast.
  [[nodiscard]] std::string rate_problem(const std::string& client_id);
  [[nodiscard]] pointer_t* find_replaceable(int pointer);
  void refuse(std::string_view kind, const std::string& problem);

  [[nodiscard]] bool is_for_another(std::int64_t server_id) const { return server_id != 0 && server_id != server_id_; }

  const std::int64_t server_id_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> events_;
  std::size_t waiting_bytes_{0};
  std::unordered_map<std::string, RateLimit> rates_;
  bool interrupted_{false};
  std::int64_t rival_{0};
  Clock::time_point rival_heard_{};
  std::atomic<std::int64_t> bad_messages_{0};
  Clock::time_point next_log_{};
};

}  // namespace layfigure::messaging
