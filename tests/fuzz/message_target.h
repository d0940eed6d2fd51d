#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "layfigure/app/commands.h"
#include "layfigure/app/message_sink.h"
#include "layfigure/app/pose_publisher.h"
#include "layfigure/app/simulation.h"
#include "layfigure/messaging/inbox.h"
#include "layfigure/session/snapshots.h"

namespace layfigure::fuzz {

/// Where the server's messages go: counted, the newest reply kept.
struct CountingSink : app::MessageSink {
  void publish(const pose_t&) override { ++messages; }
  void publish(const force_t&) override { ++messages; }
  void publish(const character_t&) override { ++messages; }
  void publish(const mesh_chunk_t&) override { ++messages; }
  void publish(const reply_t& message) override {
    ++replies;
    reply = message;
  }
  void publish(const status_t&) override { ++messages; }

  std::int64_t messages{0};
  std::int64_t replies{0};
  reply_t reply{};
};

/// What came of messages.
struct MessageTally {
  std::int64_t accepted{0};  ///< commands carried out
  std::int64_t refused{0};   ///< commands answered with a reason
  std::int64_t pointers{0};  ///< poses of pointers taken
  std::int64_t bad{0};       ///< what was no message
};

/// A server without its sockets: decoders, inbox, commands and a doll in lockstep, that say when a message that was
/// refused has changed anything.
class MessageTarget {
 public:
  MessageTarget();

  /// Takes the bytes as they come from the bus, on a channel of clients. Empty, or what is wrong with how they were
  /// taken.
  [[nodiscard]] std::string receive_command(messaging::ByteView bytes);
  [[nodiscard]] std::string receive_pointer(messaging::ByteView bytes);
  [[nodiscard]] const MessageTally& tally() const { return tally_; }

 private:
  /// A new inbox now and then: one alone would refuse so many messages a second.
  messaging::Inbox& inbox();
  [[nodiscard]] std::string handle_events();
  [[nodiscard]] std::string handle(const command_t& command);
  [[nodiscard]] std::string handle(const pointer_t& pointer);
  /// Everything that a message may change, as bytes.
  [[nodiscard]] std::string fingerprint();

  app::Simulation simulation_;
  CountingSink sink_;
  app::PosePublisher poses_;
  session::SnapshotFile snapshots_;  ///< without a place for one: nothing fuzzed is written
  app::CommandProcessor commands_;
  std::optional<messaging::Inbox> inbox_;
  int received_{0};  ///< by this inbox
  MessageTally tally_;
  std::string state_;  ///< fingerprint after the last message
};

}  // namespace layfigure::fuzz
