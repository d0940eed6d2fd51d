#pragma once

#include "layfigure/messaging/broker.h"
#include "link.h"

namespace layfigure::messaging {

/// To the broker of this process: without a socket, and without a thread beside the broker's.
class BrokerLink : public Link {
 public:
  /// The broker must outlive this.
  BrokerLink(Broker& broker, Routes routes) : broker_(broker), routes_(std::move(routes)) { broker_.attach(routes_); }
  ~BrokerLink() override { broker_.detach(routes_); }

  void publish(std::string channel, Bytes bytes) override { broker_.publish(std::move(channel), std::move(bytes)); }
  /// The broker counts them.
  [[nodiscard]] std::int64_t dropped_messages() const override { return 0; }

 private:
  Broker& broker_;
  Routes routes_;
};

}  // namespace layfigure::messaging
