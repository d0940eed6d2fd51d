#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <unordered_map>
#include <vector>

#include "layfigure/messaging/protocol.h"
#include "layfigure/messaging/rate_limit.h"
#include "layfigure/messaging/send_queue.h"
#include "tcpq.h"

namespace layfigure::messaging {

/// A connected client of the broker: its socket, its subscriptions, and what waits to be sent to it.
class BrokerClient {
 public:
  /// Takes over a connected, non-blocking socket and greets the client.
  BrokerClient(int socket, const SendLimits& limits);
  ~BrokerClient();
  BrokerClient(const BrokerClient&) = delete;
  BrokerClient& operator=(const BrokerClient&) = delete;

  [[nodiscard]] int socket() const { return socket_; }
  /// False once the connection is to be closed.
  [[nodiscard]] bool is_open() const { return open_; }
  /// Why the client was refused, "" if it left by itself or has not been.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] bool has_output() const { return sending_ != nullptr || !queue_.empty(); }
  [[nodiscard]] std::int64_t dropped_messages() const { return queue_.dropped(); }

  static constexpr RateLimit::Clock::time_point kNoPause{};
  /// Until when nothing is read from it, as it sent too fast: TCP then slows it down. In the past: next_message() ends
  /// the pause.
  [[nodiscard]] RateLimit::Clock::time_point paused_until() const { return paused_until_; }
  /// Times that it was paused.
  [[nodiscard]] std::int64_t pauses() const { return pauses_; }

  /// Reads what is there, at most a bounded piece. True if there was something.
  bool read();
  /// The next message that the client published; its subscriptions are taken note of on the way. None at `now` may also
  /// mean that it has sent too much.
  [[nodiscard]] std::optional<tcpq::Publish> next_message(RateLimit::Clock::time_point now);
  /// Queues a message if the client subscribed to its channel.
  void deliver(const std::shared_ptr<const Frame>& frame);
  /// Sends as much as the socket takes.
  void flush();

 private:
  struct Subscription {
    std::string pattern;
    std::regex expression;
  };

  [[nodiscard]] bool is_within_rate(RateLimit::Clock::time_point now);
  void subscribe(const std::string& pattern);
  void unsubscribe(const std::string& pattern);
  bool is_subscribed(const std::string& channel);
  bool send_rest();
  void refuse(std::string problem);

  int socket_;
  bool open_{true};
  std::string problem_;
  tcpq::Parser parser_;
  RateLimit rate_{kMaxMessageRate, kMaxMessageBurst};
  RateLimit::Clock::time_point paused_until_{kNoPause};
  std::int64_t pauses_{0};
  std::vector<Subscription> subscriptions_;
  std::unordered_map<std::string, bool> matches_;  ///< by channel, what the subscriptions say
  SendQueue queue_;
  std::shared_ptr<const Frame> sending_;
  std::size_t sent_{0};  ///< bytes of sending_ that are gone
};

}  // namespace layfigure::messaging
