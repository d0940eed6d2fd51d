#pragma once

#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <string>
#include <vector>

namespace layfigure::messaging {

/// A message that a client received.
struct Received {
  std::string channel;
  std::string data;
};

/// A client with LCM's own tcpq implementation.
class LcmClient {
 public:
  explicit LcmClient(const std::string& url);

  void publish(const std::string& channel, const std::string& data);
  /// Returns when the server knows of the subscription.
  lcm::Subscription* subscribe(const std::string& pattern);
  void unsubscribe(lcm::Subscription* subscription);
  /// Waits until everything that was sent so far has reached the server, and what it sent before has been received.
  void synchronize();
  /// Receives until there are `count` messages; fewer only after seconds without any.
  const std::vector<Received>& receive(std::size_t count);
  [[nodiscard]] const std::vector<Received>& received() const { return received_; }

 private:
  bool handle_one();
  void receive_one(const lcm::ReceiveBuffer* buffer, const std::string& channel);

  lcm::LCM lcm_;
  std::vector<Received> received_;
  std::string echo_channel_;
  int echoes_sent_{0};
  int echoes_seen_{0};
};

/// A bare socket, for what LCM's implementation would never do.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port, const std::string& address = "127.0.0.1");
  ~RawClient();
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  [[nodiscard]] bool is_connected() const { return connected_; }
  void send(const std::string& bytes);
  /// LCM's greeting, then a subscription.
  void greet();
  void subscribe(const std::string& pattern);
  /// Reads until the server closes the connection, and counts the bytes; none if it has not within seconds.
  [[nodiscard]] std::optional<std::size_t> read_to_the_end();

 private:
  int socket_;
  bool connected_{false};
};

/// A port of 127.0.0.1 that nobody listens on, nor can while this lives.
class DeadPort {
 public:
  DeadPort();
  ~DeadPort();
  DeadPort(const DeadPort&) = delete;
  DeadPort& operator=(const DeadPort&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }

 private:
  int socket_;
  std::uint16_t port_{0};
};

/// TCP_NODELAY, 0 or 1, of every connected socket of this process one end of which has this port.
[[nodiscard]] std::vector<int> no_delay_of_connections(std::uint16_t port);

/// Waits, for seconds at most, until it holds.
[[nodiscard]] bool eventually(const std::function<bool()>& condition);

}  // namespace layfigure::messaging
