#include "layfigure/messaging/inbox.h"

#include <gtest/gtest.h>

#include <sstream>
#include <thread>

#include "layfigure/messaging/protocol.h"
#include "sample_messages.h"

namespace layfigure::messaging {
namespace {

using Clock = Inbox::Clock;
using testing::make_command;

constexpr std::int64_t kServer = 7;

pointer_t make_pointer(int id, std::int64_t sequence, const std::string& client = "test") {
  pointer_t pointer = testing::sample_pointer();
  pointer.client_id = client;
  pointer.pointer = id;
  pointer.sequence = sequence;
  return pointer;
}

/// "p<id>:<sequence>" and "c<sequence>" for each event.
std::string summary(const std::vector<Inbox::Event>& events) {
  std::ostringstream text;
  for (const Inbox::Event& event : events) {
    if (const auto* pointer = std::get_if<pointer_t>(&event)) {
      text << "p" << pointer->pointer << ":" << pointer->sequence << " ";
    } else {
      text << "c" << std::get<command_t>(event).sequence << " ";
    }
  }
  return text.str();
}

void send(Inbox& inbox, const pointer_t& pointer) { inbox.receive_pointer(encode(pointer)); }
void send(Inbox& inbox, const command_t& command) { inbox.receive_command(encode(command)); }

TEST(Inbox, PointersOnly_NewestOfEachWins) {
  Inbox inbox(kServer);
  for (int sequence = 1; sequence <= 100; ++sequence) send(inbox, make_pointer(sequence % 2, sequence));
  EXPECT_EQ(summary(inbox.take()), "p1:99 p0:100 ");
  EXPECT_TRUE(inbox.take().empty());
}

TEST(Inbox, CommandBetweenPointers_KeepsBoth) {
  Inbox inbox(kServer);
  send(inbox, make_pointer(0, 1));
  send(inbox, make_command(1, "grab"));
  send(inbox, make_pointer(0, 2));
  send(inbox, make_pointer(0, 3));
  EXPECT_EQ(summary(inbox.take()), "p0:1 c1 p0:3 ");
}

TEST(Inbox, OlderPointerOfTheSameClient_DoesNotReplaceANewerOne) {
  Inbox inbox(kServer);
  send(inbox, make_pointer(0, 5));
  send(inbox, make_pointer(0, 4));
  send(inbox, make_pointer(0, 2, "another"));
  EXPECT_EQ(summary(inbox.take()), "p0:2 ");
}

TEST(Inbox, ManyCommands_AllKeptInOrder) {
  Inbox inbox(kServer);
  for (int sequence = 1; sequence <= 5000; ++sequence) send(inbox, make_command(sequence, "key"));
  const std::vector<Inbox::Event> events = inbox.take();
  ASSERT_EQ(events.size(), 5000U);
  for (int i = 0; i < 5000; ++i) EXPECT_EQ(std::get<command_t>(events[static_cast<std::size_t>(i)]).sequence, i + 1);
}

TEST(Inbox, MoreThanCanWait_CountedAsBad) {
  Inbox inbox(kServer);
  const Bytes command = encode(make_command(1, "key"));
  for (int i = 0; i < 65536 + 3; ++i) inbox.receive_command(command);
  EXPECT_EQ(inbox.bad_messages(), 3);
  EXPECT_EQ(inbox.take().size(), 65536U);
}

TEST(Inbox, ClientThatSendsTooFast_RefusedAndCountedOthersAreHeard) {
  Inbox inbox(kServer);
  const Bytes pointer = encode(make_pointer(0, 1, "flood"));
  const auto start = Clock::now();
  const int sent = static_cast<int>(kMaxMessageBurst) + 100'000;
  for (int i = 0; i < sent; ++i) inbox.receive_pointer(pointer);
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  EXPECT_GE(static_cast<double>(inbox.bad_messages()), 100'000 - kMaxMessageRate * seconds - 1);
  const std::int64_t bad = inbox.bad_messages();
  if (seconds < 100'000 / kMaxMessageRate) {  // else this machine is too slow to flood it
    EXPECT_GT(bad, 0);
  }
  send(inbox, make_pointer(1, 1, "another"));
  EXPECT_EQ(inbox.bad_messages(), bad);
  EXPECT_EQ(summary(inbox.take()), "p0:1 p1:1 ");
}

TEST(Inbox, LargeCommands_WaitUpToALimitOfBytes) {
  Inbox inbox(kServer);
  command_t command = make_command(1, "set");
  testing::add_argument(command, testing::number_argument("values", std::vector<double>(65'000)));
  const Bytes bytes = encode(command);
  const std::size_t fit = (64U << 20) / bytes.size();
  for (std::size_t i = 0; i < fit + 2; ++i) inbox.receive_command(bytes);
  EXPECT_EQ(inbox.bad_messages(), 2);
  EXPECT_EQ(inbox.take(1).size(), 1U);
  inbox.receive_command(bytes);
  EXPECT_EQ(inbox.bad_messages(), 2) << "what was taken has made room";
  EXPECT_EQ(inbox.take().size(), fit);
}

TEST(Inbox, TakeSome_LeavesTheRestInOrder) {
  Inbox inbox(kServer);
  for (int sequence = 1; sequence <= 5; ++sequence) send(inbox, make_command(sequence, "key"));
  EXPECT_EQ(summary(inbox.take(2)), "c1 c2 ");
  send(inbox, make_command(6, "key"));
  EXPECT_EQ(summary(inbox.take(3)), "c3 c4 c5 ");
  inbox.wait_until(Clock::time_point::max());  // there is one more
  EXPECT_EQ(summary(inbox.take()), "c6 ");
}

TEST(Inbox, Garbage_CountedAndNotQueued) {
  Inbox inbox(kServer);
  const Bytes garbage(100, 0xab);
  inbox.receive_pointer(garbage);
  inbox.receive_command(garbage);
  inbox.receive_command({});
  EXPECT_EQ(inbox.bad_messages(), 3);
  inbox.receive_status(garbage);
  EXPECT_EQ(inbox.bad_messages(), 4);
  EXPECT_EQ(inbox.rival(), 0);
  EXPECT_TRUE(inbox.take().empty());
}

TEST(Inbox, PointerOfTwoClients_LastToArriveWins) {
  Inbox inbox(kServer);
  send(inbox, make_pointer(0, 9, "one"));
  send(inbox, make_pointer(0, 1, "other"));
  EXPECT_EQ(summary(inbox.take()), "p0:1 ");
  send(inbox, make_pointer(0, 2, "other"));
  send(inbox, make_pointer(0, 10, "one"));
  EXPECT_EQ(summary(inbox.take()), "p0:10 ");
}

TEST(Inbox, CommandsOfTwoClientsWithEqualSequences_AllKeptInOrder) {
  Inbox inbox(kServer);
  std::string sent;
  for (int sequence = 1; sequence <= 50; ++sequence) {
    for (const char* client : {"one", "other"}) {
      command_t command = make_command(sequence, "key");
      command.client_id = client;
      send(inbox, command);
      sent += std::string(client) + " ";
    }
  }
  std::string taken;
  for (const Inbox::Event& event : inbox.take()) taken += std::get<command_t>(event).client_id + " ";
  EXPECT_EQ(taken, sent);
}

TEST(Inbox, OtherProtocolVersion_OfEachType_OnlyACommandIsLeftToBeAnswered) {
  Inbox inbox(kServer);
  pointer_t pointer = make_pointer(0, 1);
  pointer.protocol_version = 2;
  status_t status = testing::sample_status();
  status.protocol_version = 2;
  command_t command = make_command(1, "step");
  command.protocol_version = 2;
  send(inbox, pointer);
  inbox.receive_status(encode(status));
  EXPECT_EQ(inbox.bad_messages(), 2);
  EXPECT_EQ(inbox.rival(), 0);
  send(inbox, command);
  EXPECT_EQ(inbox.bad_messages(), 2);
  EXPECT_EQ(summary(inbox.take()), "c1 ");
}

TEST(InboxWait, NothingArrives_ReturnsAtTheDeadline) {
  Inbox inbox(kServer);
  const Clock::time_point deadline = Clock::now() + std::chrono::milliseconds(20);
  inbox.wait_until(deadline);
  EXPECT_GE(Clock::now(), deadline);
}

TEST(InboxWait, MessageFromAnotherThread_EndsIt) {
  Inbox inbox(kServer);
  std::thread sender([&] { send(inbox, make_command(1, "key")); });
  inbox.wait_until(Clock::time_point::max());
  sender.join();
  EXPECT_EQ(summary(inbox.take()), "c1 ");
}

TEST(InboxWait, InterruptBeforehand_EndsOnlyTheNextWait) {
  Inbox inbox(kServer);
  inbox.interrupt();
  inbox.wait_until(Clock::time_point::max());
  const Clock::time_point deadline = Clock::now() + std::chrono::milliseconds(20);
  inbox.wait_until(deadline);
  EXPECT_GE(Clock::now(), deadline);
}

}  // namespace
}  // namespace layfigure::messaging
