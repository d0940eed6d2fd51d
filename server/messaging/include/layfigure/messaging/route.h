#pragma once

#include <functional>
#include <string>
#include <vector>

#include "layfigure/messaging/codec.h"

namespace layfigure::messaging {

/// Called with a message's bytes, which are valid during the call only.
using MessageHandler = std::function<void(ByteView)>;

/// Where the messages of a channel go: of exactly that name.
struct Route {
  std::string channel;
  MessageHandler handler;

  /// Calls the handler. What it throws is logged: nothing may come out of a C callback, or end a thread.
  void take(ByteView bytes) const noexcept;
};
using Routes = std::vector<Route>;

}  // namespace layfigure::messaging
