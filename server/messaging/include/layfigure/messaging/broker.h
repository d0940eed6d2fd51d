#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "layfigure/messaging/send_queue.h"

namespace layfigure::messaging {

/// The broker could not listen. what() is one line that names the port and the mend.
class BrokerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Never relayed: see Broker::key().
inline constexpr const char* kBrokerKeyChannel = "LAYFIGURE_BROKER_KEY";

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
  /// Delivers what has arrived (for at most half a second), then disconnects everybody.
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  /// tcpq://127.0.0.1:port
  [[nodiscard]] std::string url() const;
  /// What a connection publishes on kBrokerKeyChannel to be read at any rate: that of the server itself. Random, known
  /// to this process alone.
  [[nodiscard]] const std::string& key() const;

  /// Clients that are connected, without the server's own connections. Thread-safe.
  [[nodiscard]] int clients() const;
  /// Times that a client was made to wait, as it sent too fast. Thread-safe.
  [[nodiscard]] std::int64_t pauses() const;
  /// State messages that slow clients did not get. Thread-safe.
  [[nodiscard]] std::int64_t dropped_messages() const;
  /// Clients that were disconnected because they broke the protocol or fell too far behind. Thread-safe.
  [[nodiscard]] std::int64_t refused_clients() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace layfigure::messaging
