#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "layfigure/messaging/route.h"
#include "layfigure/messaging/send_queue.h"

namespace layfigure::messaging {

/// The broker could not listen. what() is one line that names the port and the mend.
class BrokerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A server of LCM's tcpq protocol on 127.0.0.1, for machines without multicast and for links that must not lose
/// anything. It relays each published message to every client (the sender too) with a subscription, a regular
/// expression, that matches the whole name of the channel.
///
/// One thread, non-blocking sockets with TCP_NODELAY, and a bounded queue per client (SendQueue): a slow or stopped
/// client delays nobody, and is disconnected if its queue overflows. So is one that does not keep to the protocol, and
/// one that sends more than kMaxMessageBytes at once. One that sends faster than kMaxMessageRate is read no faster: its
/// own sending blocks, nothing of it is lost. Beyond kMaxClients others are turned away.
class Broker {
 public:
  /// Listens on 127.0.0.1:port; port 0 takes any free one. Throws BrokerError, e.g. if the port is busy.
  explicit Broker(std::uint16_t port, const SendLimits& limits = {});
  /// Delivers what was published and has arrived (for at most half a second), then disconnects everybody.
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  /// tcpq://127.0.0.1:port
  [[nodiscard]] std::string url() const;

  /// Queues a message for all who listen and returns at once: the broker's thread sends it. Any rate is allowed; if the
  /// broker does not keep up, the oldest state messages are dropped first. Thread-safe; allocates.
  void publish(std::string channel, Bytes bytes);
  /// From now on the routes' handlers are called on the broker's thread, which waits for them. `routes` must stay until
  /// detach(). Thread-safe, but not from a handler.
  void attach(const Routes& routes);
  /// When this returns, no handler of these routes is at work or will be called.
  void detach(const Routes& routes);

  /// Clients that are connected. Thread-safe.
  [[nodiscard]] int clients() const;
  /// Times that a client was made to wait, as it sent too fast. Thread-safe.
  [[nodiscard]] std::int64_t pauses() const;
  /// State messages that slow clients did not get, and what publish() had no room for. Thread-safe.
  [[nodiscard]] std::int64_t dropped_messages() const;
  /// Clients that were disconnected because they broke the protocol or fell too far behind. Thread-safe.
  [[nodiscard]] std::int64_t refused_clients() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace layfigure::messaging
