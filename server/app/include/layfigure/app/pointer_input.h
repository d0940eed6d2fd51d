#pragma once

#include <cstdint>
#include <string>

namespace layfigure::app {

/// The messages of one pointer: whose the newest was, and how far apart they come. A pointer is nobody's own: of
/// several clients that move it, the one whose message came last is followed.
class PointerInput {
 public:
  [[nodiscard]] const std::string& client_id() const { return client_id_; }
  [[nodiscard]] std::int64_t sequence() const { return sequence_; }
  /// Steps between messages, a running mean that forgets half of its past with each. At least 1.
  [[nodiscard]] double message_interval() const { return message_interval_; }

  /// The same client has sent this message or a newer one already.
  [[nodiscard]] bool is_old(const std::string& client_id, std::int64_t sequence) const {
    return client_id_ == client_id && sequence <= sequence_;
  }

  /// Takes note of a message that comes before step `step`. A longer silence than `longest_interval` [steps], >= 1, was
  /// a rest: it counts as so long.
  void receive(std::string client_id, std::int64_t sequence, std::int64_t step, double longest_interval);

 private:
  std::string client_id_;
  std::int64_t sequence_{0};  // 0: no message yet
  std::int64_t received_at_step_{0};
  double message_interval_{1.0};
};

}  // namespace layfigure::app
