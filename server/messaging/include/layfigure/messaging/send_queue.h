#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "layfigure/messaging/codec.h"

namespace layfigure::messaging {

/// A message on its way out, shared by all the queues that it waits in.
struct Frame {
  std::string channel;
  Bytes bytes;
  bool is_state{false};  ///< only the newest matters: may be dropped for newer ones
};

/// How many bytes may wait. Both in bytes, > 0.
struct SendLimits {
  std::size_t state{32U << 20};  ///< above it the oldest state messages give way; holds minutes of poses
  std::size_t total{96U << 20};  ///< above it, with no state message left to drop, the queue has overflown
};

/// A bounded queue of messages in their order. Newest state wins; nothing else is ever dropped. Not thread-safe.
class SendQueue {
 public:
  explicit SendQueue(const SendLimits& limits = {}) : limits_(limits) {}

  /// Appends a frame. False: the queue has overflown, the frame is not in it.
  [[nodiscard]] bool push(std::shared_ptr<const Frame> frame);
  /// Takes the oldest frame, null if there is none.
  [[nodiscard]] std::shared_ptr<const Frame> pop();

  [[nodiscard]] bool empty() const { return frames_.empty(); }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// State messages dropped so far.
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

 private:
  bool drop_oldest_state();

  SendLimits limits_;
  std::deque<std::shared_ptr<const Frame>> frames_;
  std::size_t bytes_{0};
  std::int64_t dropped_{0};
};

}  // namespace layfigure::messaging
