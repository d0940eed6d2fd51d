#pragma once

#include <cstdint>
#include <string>

#include "layfigure/messaging/codec.h"

namespace layfigure::messaging {

/// What carries a bus's messages. Its routes' handlers are called until its destructor returns, one at a time; nothing
/// that they throw goes any further.
class Link {
 public:
  Link() = default;
  virtual ~Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Queues a message and returns at once. Thread-safe.
  virtual void publish(std::string channel, Bytes bytes) = 0;
  /// Messages that this link had no room for. Thread-safe.
  [[nodiscard]] virtual std::int64_t dropped_messages() const = 0;
};

}  // namespace layfigure::messaging
