#include "layfigure/messaging/bus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>

#include "layfigure/messaging/broker.h"
#include "layfigure/messaging/inbox.h"
#include "sample_messages.h"
#include "tcpq_client.h"

namespace layfigure::messaging {
namespace {

std::string bytes_of(const auto& message) {
  const Bytes bytes = encode(message);
  return {bytes.begin(), bytes.end()};
}

/// Collects, on the bus's thread, the sequence numbers of commands.
class Commands {
 public:
  Bus::Handlers handlers() {
    return {{Channel::kCommand, [this](ByteView bytes) {
               const Decoded<command_t> decoded = decode_command(bytes);
               const std::lock_guard lock(mutex_);
               sequences_.push_back(decoded.message ? decoded.message->sequence : -1);
             }}};
  }
  std::vector<std::int64_t> get() {
    const std::lock_guard lock(mutex_);
    return sequences_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::int64_t> sequences_;
};

TEST(Bus, Publish_ReachesASubscriberWithTheSameBytes) {
  Broker broker(0);
  LcmClient client(broker.url());
  client.subscribe("t1_LAYFIGURE_POSE");
  Bus bus({broker.url(), "t1_"}, {});
  bus.publish(Channel::kPose, testing::sample_pose());
  ASSERT_EQ(client.receive(1).size(), 1U);
  EXPECT_EQ(client.received()[0].data, bytes_of(testing::sample_pose()));
}

TEST(Bus, Commands_ReachTheHandlerInOrder) {
  Broker broker(0);
  Commands commands;
  Bus bus({broker.url(), ""}, commands.handlers());
  LcmClient client(broker.url());
  EXPECT_TRUE(eventually([&] {  // until the broker knows of the bus's subscription
    client.publish("LAYFIGURE_COMMAND", bytes_of(testing::make_command(1000, "key")));
    return !commands.get().empty();
  }));
  for (int i = 1; i <= 500; ++i) client.publish("LAYFIGURE_COMMAND", bytes_of(testing::make_command(i, "key")));
  ASSERT_TRUE(eventually([&] { return commands.get().back() == 500; }));
  const std::vector<std::int64_t> sequences = commands.get();
  EXPECT_EQ(sequences.size(), static_cast<std::size_t>(std::ranges::count(sequences, 1000)) + 500);
  EXPECT_TRUE(std::is_sorted(sequences.end() - 500, sequences.end()));
}

TEST(Bus, HandlerThatThrows_DoesNotEndIt) {
  Broker broker(0);
  std::atomic<int> calls{0};
  Bus bus({broker.url(), ""}, {{Channel::kCommand, [&](ByteView) {
                                  ++calls;
                                  throw std::runtime_error("no good");
                                }}});
  LcmClient client(broker.url());
  EXPECT_TRUE(eventually([&] {
    client.publish("LAYFIGURE_COMMAND", "");
    return calls > 2;
  }));
}

TEST(Bus, OtherPrefix_HearsNothing) {
  Broker broker(0);
  Commands mine;
  Commands other;
  Bus bus({broker.url(), "a_"}, mine.handlers());
  Bus other_bus({broker.url(), "b_"}, other.handlers());
  LcmClient client(broker.url());
  EXPECT_TRUE(eventually([&] {
    client.publish("b_LAYFIGURE_COMMAND", bytes_of(testing::make_command(1, "key")));
    return !other.get().empty();
  }));
  EXPECT_TRUE(mine.get().empty());
}

TEST(Bus, Closed_HasSentEverythingThatWasPublished) {
  auto broker = std::make_unique<Broker>(0);
  LcmClient client(broker->url());
  client.subscribe("LAYFIGURE_REPLY");
  {
    Bus bus({broker->url(), ""}, {});
    for (int i = 0; i < 3000; ++i) bus.publish(Channel::kReply, testing::sample_reply());
  }
  broker.reset();
  EXPECT_EQ(client.receive(3000).size(), 3000U);
}

TEST(Bus, NoServerAtTheUrl_ThrowsOneLineNamingIt) {
  const DeadPort dead;
  const std::string url = "tcpq://127.0.0.1:" + std::to_string(dead.port());
  try {
    const Bus bus({url, ""}, {});
    FAIL() << "connected to nothing";
  } catch (const BusError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find(url), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos);
  }
}

TEST(Bus, UnknownProvider_Throws) { EXPECT_THROW(Bus({"nonsense://x", ""}, {}), BusError); }

TEST(Bus, ServerRestarted_ConnectsAgain) {
  auto broker = std::make_unique<Broker>(0);
  const std::uint16_t port = broker->port();
  Commands commands;
  Bus bus({broker->url(), ""}, commands.handlers());
  broker.reset();
  broker = std::make_unique<Broker>(port);
  LcmClient client(broker->url());
  client.subscribe("LAYFIGURE_STATUS");
  EXPECT_TRUE(eventually([&] {
    client.publish("LAYFIGURE_COMMAND", bytes_of(testing::make_command(1, "key")));
    return !commands.get().empty();
  }));
  EXPECT_TRUE(eventually([&] {  // the sending side notices when it sends
    bus.publish(Channel::kStatus, testing::sample_status());
    client.synchronize();
    return !client.received().empty();
  }));
}

TEST(MulticastTtl, Url_TellsIt) {
  EXPECT_EQ(multicast_ttl("udpm://239.255.76.67:7667?ttl=0"), 0);
  EXPECT_EQ(multicast_ttl("udpm://239.255.76.67:7667?ttl=1"), 1);
  EXPECT_EQ(multicast_ttl("udpm://239.255.76.67:7667?recv_buf_size=100&ttl=12"), 12);
  EXPECT_EQ(multicast_ttl("udpm://239.255.76.67:7667?ttl=2&recv_buf_size=100"), 2);
  EXPECT_EQ(multicast_ttl("udpm://239.255.76.67:7667"), 0);
  EXPECT_EQ(multicast_ttl("udpm://239.255.76.67:7667?ttl=junk"), 0);
  EXPECT_EQ(multicast_ttl("tcpq://127.0.0.1:7700?ttl=3"), 0);
  EXPECT_EQ(multicast_ttl(default_bus_url()), 0);
}

TEST(Bus, BothEndsOfATcpqLink_SendAtOnce) {
  Broker broker(0);
  const Bus bus({broker.url(), ""}, {});
  EXPECT_TRUE(eventually([&] { return broker.clients() == 2; }));  // it has a link to receive and one to send
  // All sockets are in this process: both ends of both links.
  const std::vector<int> delays = no_delay_of_connections(broker.port());
  EXPECT_EQ(delays, std::vector<int>(4, 1));
}

/// A bus of the process that the broker is in.
BusSettings own(Broker& broker) { return {.url = broker.url(), .channel_prefix = "", .broker = &broker}; }

TEST(BusOfTheBrokersProcess, Publish_ReachesSubscribersWithTheSameBytes) {
  Broker broker(0);
  LcmClient client(broker.url());
  client.subscribe("LAYFIGURE_POSE");
  Bus bus(own(broker), {});
  bus.publish(Channel::kPose, testing::sample_pose());
  ASSERT_EQ(client.receive(1).size(), 1U);
  EXPECT_EQ(client.received()[0].data, bytes_of(testing::sample_pose()));
}

TEST(BusOfTheBrokersProcess, Commands_ReachTheHandlerInOrder) {
  Broker broker(0);
  Commands commands;
  const Bus bus(own(broker), commands.handlers());
  LcmClient client(broker.url());
  for (int i = 1; i <= 500; ++i) client.publish("LAYFIGURE_COMMAND", bytes_of(testing::make_command(i, "key")));
  ASSERT_TRUE(eventually([&] { return commands.get().size() == 500; }));
  const std::vector<std::int64_t> sequences = commands.get();
  EXPECT_TRUE(std::ranges::is_sorted(sequences));
}

TEST(BusOfTheBrokersProcess, Publish_ReachesOtherBusesOfTheProcess) {
  Broker broker(0);
  Commands commands;
  const Bus listener(own(broker), commands.handlers());
  Bus bus(own(broker), {});
  bus.publish(Channel::kCommand, testing::make_command(7, "key"));
  ASSERT_TRUE(eventually([&] { return !commands.get().empty(); }));
  EXPECT_EQ(commands.get(), std::vector<std::int64_t>{7});
}

TEST(BusOfTheBrokersProcess, HandlerThatThrows_DoesNotEndTheBroker) {
  Broker broker(0);
  std::atomic<int> calls{0};
  const Bus bus(own(broker), {{Channel::kCommand, [&](ByteView) {
                                 ++calls;
                                 throw std::runtime_error("no good");
                               }}});
  LcmClient client(broker.url());
  for (int i = 0; i < 3; ++i) client.publish("LAYFIGURE_COMMAND", "");
  EXPECT_TRUE(eventually([&] { return calls == 3; }));
}

TEST(BusOfTheBrokersProcess, HandlerThatPublishes_IsAnswered) {
  Broker broker(0);
  std::unique_ptr<Bus> bus;
  bus = std::make_unique<Bus>(
      own(broker),
      Bus::Handlers{{Channel::kCommand, [&](ByteView) { bus->publish(Channel::kReply, testing::sample_reply()); }}});
  LcmClient client(broker.url());
  client.subscribe("LAYFIGURE_REPLY");
  client.publish("LAYFIGURE_COMMAND", "");
  EXPECT_EQ(client.receive(1).size(), 1U);
}

TEST(BusOfTheBrokersProcess, OtherPrefix_HearsNothing) {
  Broker broker(0);
  Commands mine;
  Commands other;
  const Bus bus({broker.url(), "a_", &broker}, mine.handlers());
  const Bus other_bus({broker.url(), "b_", &broker}, other.handlers());
  LcmClient client(broker.url());
  client.publish("b_LAYFIGURE_COMMAND", bytes_of(testing::make_command(1, "key")));
  EXPECT_TRUE(eventually([&] { return !other.get().empty(); }));
  EXPECT_TRUE(mine.get().empty());
}

TEST(BusOfTheBrokersProcess, Closed_HearsNoMore) {
  Broker broker(0);
  Commands commands;
  LcmClient client(broker.url());
  { const Bus bus(own(broker), commands.handlers()); }
  client.publish("LAYFIGURE_COMMAND", bytes_of(testing::make_command(1, "key")));
  client.synchronize();
  EXPECT_TRUE(commands.get().empty());
}

TEST(BusOfTheBrokersProcess, IsNoClient) {
  Broker broker(0);
  const Bus bus(own(broker), {});
  const LcmClient client(broker.url());
  EXPECT_TRUE(eventually([&] { return broker.clients() == 1; }));
}

TEST(BusOfTheBrokersProcess, MayPublishAtAnyRate) {
  Broker broker(0);
  LcmClient client(broker.url());
  client.subscribe("LAYFIGURE_REPLY");
  client.synchronize();
  const int count = static_cast<int>(kMaxMessageBurst) + 5000;
  Bus bus(own(broker), {});
  for (int i = 0; i < count; ++i) bus.publish(Channel::kReply, testing::sample_reply());
  EXPECT_EQ(client.receive(static_cast<std::size_t>(count)).size(), static_cast<std::size_t>(count));
  EXPECT_EQ(broker.pauses(), 0);
  EXPECT_EQ(broker.dropped_messages(), 0);
}

TEST(BusOfTheBrokersProcess, BrokerDestroyed_HasSentEverythingThatWasPublished) {
  auto broker = std::make_unique<Broker>(0);
  LcmClient client(broker->url());
  client.subscribe("LAYFIGURE_REPLY");
  client.synchronize();
  {
    Bus bus(own(*broker), {});
    for (int i = 0; i < 3000; ++i) bus.publish(Channel::kReply, testing::sample_reply());
  }
  broker.reset();
  EXPECT_EQ(client.receive(3000).size(), 3000U);
}

TEST(DefaultBusUrl, Environment_ComesFirst) {
  setenv("LCM_DEFAULT_URL", "tcpq://127.0.0.1:7777", 1);
  EXPECT_EQ(default_bus_url(), "tcpq://127.0.0.1:7777");
  setenv("LCM_DEFAULT_URL", "", 1);
  EXPECT_EQ(default_bus_url(), "udpm://239.255.76.67:7667?ttl=0");
  unsetenv("LCM_DEFAULT_URL");
  EXPECT_EQ(default_bus_url(), "udpm://239.255.76.67:7667?ttl=0");
}

}  // namespace
}  // namespace layfigure::messaging
