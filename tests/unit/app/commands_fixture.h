#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "layfigure/app/commands.h"
#include "layfigure/cache/bytes.h"
#include "recording_sink.h"
#include "sample_messages.h"
#include "small_doll.h"

namespace layfigure::app {

using testing::add_argument;
using testing::make_command;
using testing::number_argument;
using testing::text_argument;

inline std::vector<double> result(const reply_t& reply, const std::string& name) {
  for (const argument_t& value : reply.results) {
    if (value.name == name) return value.values;
  }
  return {};
}

class Commands : public ::testing::Test {
 protected:
  explicit Commands(ClockKind clock = ClockKind::kLockstep, doll::Doll doll = testing::small_doll())
      : simulation_(std::move(doll), {.clock = clock}),
        poses_(simulation_, sink_, 77),
        snapshots_(simulation_.doll(), {}),
        processor_(simulation_, poses_, sink_, snapshots_, 77) {
    poses_.publish_if_due();
  }

  /// Sends the next command and returns its reply.
  reply_t send(const std::string& name, const std::vector<argument_t>& arguments = {}) {
    command_t command = make_command(++sequence_, name);
    for (const argument_t& argument : arguments) add_argument(command, argument);
    return handle(command);
  }

  reply_t handle(const command_t& command) {
    processor_.handle(command);
    while (processor_.is_sending_mesh()) processor_.send_mesh_chunk();
    const reply_t& reply = sink_.replies.back();
    EXPECT_EQ(reply.client_id, command.client_id);
    EXPECT_EQ(reply.sequence, command.sequence);
    EXPECT_EQ(reply.accepted != 0, reply.reason.empty());
    return reply;
  }

  void point(std::int64_t sequence, const Eigen::Vector3d& position, const std::string& client = "test") {
    simulation_.point(0, {position, Eigen::Quaterniond::Identity()}, client, sequence);
  }

  /// All that a command could change of the doll, bit for bit.
  [[nodiscard]] std::string fingerprint() const {
    std::string bytes = memory();
    for (const dynamics::BodyState& body : simulation_.state().bodies) {
      bytes += cache::to_bytes(body.linear_momentum) + cache::to_bytes(body.angular_momentum);
      bytes += cache::to_bytes(body.yield_scale) + cache::to_bytes(body.rest_time) + (body.asleep ? "z" : "a");
    }
    for (const int id : simulation_.hands().busy_pointers()) bytes += "p" + std::to_string(id);
    return bytes + "h" + std::to_string(simulation_.history().undoable());
  }
  [[nodiscard]] std::string memory() const { return cache::to_bytes(simulation_.hands().memory()); }

  RecordingSink sink_;
  Simulation simulation_;
  PosePublisher poses_;
  session::SnapshotFile snapshots_;
  CommandProcessor processor_;
  std::int64_t sequence_{0};
};

class RealtimeCommands : public Commands {
 protected:
  RealtimeCommands() : Commands(ClockKind::kRealtime) {}
};

}  // namespace layfigure::app
