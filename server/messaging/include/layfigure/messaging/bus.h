#pragma once

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "layfigure/messaging/codec.h"
#include "layfigure/messaging/protocol.h"
#include "layfigure/messaging/route.h"

namespace layfigure::messaging {

class Broker;
class Link;

/// The bus could not be opened. what() is one line that names the URL and the mend.
class BusError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct BusSettings {
  std::string url;             ///< of LCM: udpm://.., tcpq://..; see default_bus_url()
  std::string channel_prefix;  ///< put before every channel's name, see is_channel_prefix()
  Broker* broker{nullptr};     ///< this process's own, which takes the place of the url; must outlive the bus
};

/// $LCM_DEFAULT_URL if set, else multicast that does not leave this machine (udpm, ttl 0).
[[nodiscard]] std::string default_bus_url();

/// How many networks away a udpm URL sends: 0 not beyond this machine, which is LCM's default; 0 for other URLs too.
[[nodiscard]] int multicast_ttl(std::string_view url);

/// A place on an LCM bus. Neither a slow network nor a slow subscriber can delay who publishes: other threads send and
/// receive. A tcpq server that is lost is reported and connected to again, about once a second; a broker of this
/// process itself needs no connection, and cannot be lost.
class Bus {
 public:
  /// Called on the receive thread, or the broker's.
  using Handlers = std::map<Channel, MessageHandler>;

  /// Connects and subscribes. Throws BusError.
  Bus(const BusSettings& settings, Handlers handlers);
  /// Sends what is queued (for at most about a second; a broker does so in its own destructor), then disconnects.
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// Queues a message and returns at once; the order of messages is kept. If the bus does not keep up, the oldest state
  /// messages (is_state_channel) are dropped first. Thread-safe.
  template <class Message>
  void publish(Channel channel, const Message& message) {
    publish_bytes(channel, encode(message));
  }

  /// Messages that were dropped because the bus did not keep up, of whatever channel. A broker counts its own.
  [[nodiscard]] std::int64_t dropped_messages() const;

 private:
  void publish_bytes(Channel channel, Bytes bytes);

  std::string prefix_;
  std::unique_ptr<Link> link_;
};

}  // namespace layfigure::messaging
