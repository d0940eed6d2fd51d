#include "layfigure/messaging/broker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <thread>

#include "layfigure/messaging/protocol.h"
#include "tcpq_client.h"

namespace layfigure::messaging {
namespace {

constexpr SendLimits kSmall{.state = 200'000, .total = 400'000};
// What the kernel buffers for a client that does not read is a few MB: this is well above.
constexpr std::size_t kFloodBytes = 40'000'000;
constexpr std::size_t kPieceBytes = 50'000;

TEST(Broker, ManyMessages_ArriveCompleteAndInOrder) {
  Broker broker(0);
  LcmClient receiver(broker.url());
  LcmClient sender(broker.url());
  receiver.subscribe("NUMBERS");
  for (int i = 0; i < 2000; ++i) sender.publish("NUMBERS", std::to_string(i));
  const std::vector<Received>& received = receiver.receive(2000);
  ASSERT_EQ(received.size(), 2000U);
  for (std::size_t i = 0; i < received.size(); ++i) EXPECT_EQ(received[i].data, std::to_string(i));
}

TEST(Broker, LargeMessage_ArrivesWhole) {
  Broker broker(0);
  LcmClient client(broker.url());
  client.subscribe("LARGE");
  const std::string data(5'000'000, 'x');
  client.publish("LARGE", data);
  ASSERT_EQ(client.receive(1).size(), 1U);
  EXPECT_EQ(client.received()[0].data, data);
}

TEST(Broker, OwnProcessPublishesFasterThanItRelays_OldestStatesGiveWay) {
  Broker broker(0, kSmall);
  std::promise<void> go_on;
  const Routes stuck{{"STUCK", [&](ByteView) { go_on.get_future().wait(); }}};
  std::vector<std::size_t> states;
  std::promise<void> end;
  const Routes listening{{"LAYFIGURE_POSE", [&](ByteView bytes) { states.push_back(bytes.size()); }},
                         {"LAYFIGURE_REPLY", [&](ByteView) { end.set_value(); }}};
  broker.attach(stuck);
  broker.attach(listening);
  broker.publish("STUCK", {});
  const std::size_t room = kSmall.state / kPieceBytes;
  const std::size_t most = 2 * room;  // while at most one is being relayed
  for (std::size_t k = 1; k <= most; ++k) broker.publish("LAYFIGURE_POSE", Bytes(kPieceBytes + k));
  broker.publish("LAYFIGURE_REPLY", Bytes(10));
  go_on.set_value();
  ASSERT_EQ(end.get_future().wait_for(std::chrono::seconds(10)), std::future_status::ready);
  broker.detach(stuck);
  broker.detach(listening);
  ASSERT_FALSE(states.empty());
  EXPECT_EQ(states.back(), kPieceBytes + most) << "the newest is there";
  EXPECT_TRUE(std::ranges::is_sorted(states));
  EXPECT_EQ(broker.dropped_messages(), static_cast<std::int64_t>(most - states.size()));
  EXPECT_GT(broker.dropped_messages(), 0);
}

TEST(Broker, Pattern_MustMatchTheWholeChannel) {
  Broker broker(0);
  LcmClient receiver(broker.url());
  receiver.subscribe("LAYFIGURE_.*");
  receiver.subscribe("STATUS");
  LcmClient sender(broker.url());
  for (const char* channel : {"LAYFIGURE_POSE", "X_LAYFIGURE_POSE", "STATUS", "STATUS2", "MY_STATUS", "LAYFIGURE_"}) {
    sender.publish(channel, "");
  }
  sender.synchronize();
  receiver.synchronize();
  std::vector<std::string> channels;
  for (const Received& message : receiver.received()) channels.push_back(message.channel);
  EXPECT_EQ(channels, (std::vector<std::string>{"LAYFIGURE_POSE", "STATUS", "LAYFIGURE_"}));
}

TEST(Broker, OverlappingPatterns_DeliverOnce) {
  auto broker = std::make_unique<Broker>(0);
  RawClient receiver(broker->port());
  receiver.greet();
  receiver.subscribe("A.*");
  receiver.subscribe("A.?");
  LcmClient sender(broker->url());
  sender.subscribe("AB");
  sender.publish("AB", "123");
  EXPECT_EQ(sender.receive(1).size(), 1U);
  broker.reset();
  EXPECT_EQ(receiver.read_to_the_end(), 8U + (4 + 4 + 2 + 4 + 3));  // the greeting, one message
}

TEST(Broker, Unsubscribe_EndsDelivery) {
  Broker broker(0);
  LcmClient client(broker.url());
  lcm::Subscription* subscription = client.subscribe("A");
  client.publish("A", "1");
  client.receive(1);
  client.unsubscribe(subscription);
  client.publish("A", "2");
  client.synchronize();
  EXPECT_EQ(client.received().size(), 1U);
}

TEST(Broker, StoppedSubscriberOfState_DelaysNobodyAndLosesTheOldest) {
  Broker broker(0, kSmall);
  RawClient stopped(broker.port());
  stopped.greet();
  stopped.subscribe(".*");
  LcmClient client(broker.url());
  client.subscribe("LAYFIGURE_POSE");
  std::size_t count = 0;
  while (count * kPieceBytes < kFloodBytes) {  // each message is received before the next is sent
    client.publish("LAYFIGURE_POSE", std::string(kPieceBytes, 'p'));
    ASSERT_EQ(client.receive(++count).size(), count);
  }
  EXPECT_TRUE(eventually([&] { return broker.dropped_messages() > 0; }));
  EXPECT_EQ(broker.refused_clients(), 0);
}

TEST(Broker, StoppedSubscriberOfCommands_IsDisconnected) {
  Broker broker(0, kSmall);
  RawClient stopped(broker.port());
  stopped.greet();
  stopped.subscribe("LAYFIGURE_COMMAND");
  LcmClient client(broker.url());
  client.subscribe("LAYFIGURE_COMMAND");
  std::size_t count = 0;
  while (count * kPieceBytes < kFloodBytes) {
    client.publish("LAYFIGURE_COMMAND", std::string(kPieceBytes, 'c'));
    ASSERT_EQ(client.receive(++count).size(), count);
  }
  EXPECT_TRUE(eventually([&] { return broker.refused_clients() == 1; }));
  EXPECT_TRUE(stopped.read_to_the_end());
  EXPECT_EQ(broker.dropped_messages(), 0);
}

TEST(Broker, MalformedClients_DisconnectedAndCounted) {
  Broker broker(0);
  LcmClient client(broker.url());
  client.subscribe("A");
  int refused = 0;
  for (const std::string& bytes : {std::string("GET / HTTP/1.1\r\n\r\n"), std::string(64, '\0'),
                                   std::string("\x28\x76\x17\xfb\0\0\1\0\0\0\0\x9", 12)}) {
    RawClient malformed(broker.port());
    malformed.send(bytes);
    EXPECT_TRUE(malformed.read_to_the_end());
    EXPECT_TRUE(eventually([&] { return broker.refused_clients() == refused + 1; }));
    ++refused;
  }
  RawClient bad_pattern(broker.port());
  bad_pattern.greet();
  bad_pattern.subscribe("(");
  EXPECT_TRUE(bad_pattern.read_to_the_end());
  client.publish("A", "still here");
  EXPECT_EQ(client.receive(1).size(), 1U);
}

TEST(Broker, ClientThatLeavesInTheMiddle_IsNotRefused) {
  Broker broker(0);
  {
    RawClient leaving(broker.port());
    leaving.greet();
    leaving.send(std::string("\0\0\0\1\0\0", 6));
  }
  LcmClient client(broker.url());
  client.synchronize();
  EXPECT_EQ(broker.refused_clients(), 0);
}

TEST(Broker, PatternThatBacktracks_DoesNotStallIt) {
  Broker broker(0);
  RawClient hostile(broker.port());
  hostile.greet();
  hostile.subscribe("(a*)*(a*)*(a*)*b");
  LcmClient client(broker.url());
  client.subscribe("a+");
  client.publish(std::string(60, 'a'), "");
  EXPECT_EQ(client.receive(1).size(), 1U);
}

TEST(Broker, Flood_IsReadNoFasterThanTheRateAndLosesNothing) {
  Broker broker(0);
  LcmClient receiver(broker.url());
  receiver.subscribe("A");
  receiver.synchronize();
  constexpr int kExcess = 40'000;
  const auto count = static_cast<std::size_t>(kMaxMessageBurst) + kExcess;
  std::string messages;
  for (std::size_t i = 0; i < count; ++i) messages += std::string("\0\0\0\1\0\0\0\1A\0\0\0\0", 13);
  RawClient sender(broker.port());
  sender.greet();
  const auto start = std::chrono::steady_clock::now();
  std::thread flood([&] { sender.send(messages); });
  EXPECT_EQ(receiver.receive(count).size(), count);
  flood.join();
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  EXPECT_GE(taken.count(), kExcess / kMaxMessageRate);
  EXPECT_GT(broker.pauses(), 0);
  EXPECT_EQ(broker.refused_clients(), 0);
  receiver.synchronize();
}

TEST(Broker, MessageBeyondTheLimit_DisconnectsItsSender) {
  Broker broker(0);
  RawClient sender(broker.port());
  sender.greet();
  sender.send(std::string("\0\0\0\1\0\0\0\1A\1\0\0\1", 13));  // 16 MiB and a byte are announced
  EXPECT_TRUE(sender.read_to_the_end());
  EXPECT_TRUE(eventually([&] { return broker.refused_clients() == 1; }));
}

TEST(Broker, OneClientTooMany_IsTurnedAwayAndCounted) {
  Broker broker(0);
  std::vector<std::unique_ptr<RawClient>> clients;
  for (std::size_t i = 0; i < kMaxClients; ++i) clients.push_back(std::make_unique<RawClient>(broker.port()));
  EXPECT_TRUE(eventually([&] { return broker.clients() == static_cast<int>(kMaxClients); }));
  RawClient late(broker.port());
  EXPECT_TRUE(late.read_to_the_end());
  EXPECT_TRUE(eventually([&] { return broker.refused_clients() == 1; }));
  clients.clear();
  EXPECT_TRUE(eventually([&] { return broker.clients() == 0; }));
  LcmClient next(broker.url());
  next.synchronize();
}

TEST(Broker, TenSubscribersOneStoppedOneSlow_OthersGetEveryPose) {
  Broker broker(0, kSmall);
  constexpr int kPoses = 2400;
  const std::string pose(6000, 'p');  // as of 60 joints
  RawClient stopped(broker.port());
  stopped.greet();
  stopped.subscribe("LAYFIGURE_POSE");
  LcmClient slow(broker.url());  // it reads at the end
  slow.subscribe("LAYFIGURE_POSE");
  std::vector<std::unique_ptr<LcmClient>> subscribers;
  for (int i = 0; i < 8; ++i) {
    subscribers.push_back(std::make_unique<LcmClient>(broker.url()));
    subscribers.back()->subscribe("LAYFIGURE_POSE");
  }
  LcmClient sender(broker.url());
  for (std::size_t i = 1; i <= kPoses; ++i) {
    sender.publish("LAYFIGURE_POSE", pose);
    for (const auto& subscriber : subscribers) ASSERT_EQ(subscriber->receive(i).size(), i);
  }
  EXPECT_GT(broker.dropped_messages(), 0) << "those of who does not read";
  EXPECT_EQ(broker.refused_clients(), 0);
  slow.synchronize();
  EXPECT_GT(slow.received().size(), 0U);
}

TEST(Broker, BusyPort_ThrowsNamingIt) {
  Broker broker(0);
  try {
    Broker second(broker.port());
    FAIL() << "both listen on " << broker.port();
  } catch (const BrokerError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("127.0.0.1:" + std::to_string(broker.port())), std::string::npos) << what;
    EXPECT_NE(what.find("in use"), std::string::npos) << what;
  }
}

TEST(Broker, OtherAddressOfThisMachine_IsNotServed) {
  Broker broker(0);
  EXPECT_TRUE(RawClient(broker.port()).is_connected());
  EXPECT_FALSE(RawClient(broker.port(), "127.0.0.2").is_connected());
}

}  // namespace
}  // namespace layfigure::messaging
