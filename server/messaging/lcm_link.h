#pragma once

#include <memory>
#include <string>

#include "layfigure/messaging/route.h"
#include "link.h"

namespace layfigure::messaging {

/// A connection to an LCM bus with a thread that receives and one that sends, so that neither a slow network nor a slow
/// subscriber can delay who publishes. A tcpq socket has TCP_NODELAY, and each message goes out in one piece. A tcpq
/// server that is lost is reported and connected to again, about once a second.
class LcmLink : public Link {
 public:
  /// Connects and subscribes. Throws BusError.
  LcmLink(const std::string& url, Routes routes);
  /// Sends what is queued (for at most about a second), then disconnects.
  ~LcmLink() override;

  /// If the bus does not keep up, the oldest state messages (is_state_channel) are dropped first.
  void publish(std::string channel, Bytes bytes) override;
  [[nodiscard]] std::int64_t dropped_messages() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace layfigure::messaging
