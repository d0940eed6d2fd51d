#pragma once

#include <cstdint>
#include <layfigure/command_t.hpp>
#include <layfigure/reply_t.hpp>
#include <string_view>

#include "layfigure/app/mesh_chunks.h"
#include "layfigure/app/message_sink.h"
#include "layfigure/app/pose_publisher.h"
#include "layfigure/app/reply_cache.h"
#include "layfigure/app/simulation.h"

namespace layfigure::app {

/// The most steps that one step command may ask for.
inline constexpr std::int64_t kMaxStepsPerCommand = 10000;

/// Carries out commands and answers each with a reply_t. A command that is unknown, has a wrong or unknown argument, or
/// cannot be done is refused with the reason, and nothing has changed. Arguments in brackets may be left out.
///
///     grab           bone, [pointer 0], [point x y z], [stiffness], [damping], [mode "3dof" | "6dof"]
///                    see Simulation::grab and GrabRequest -> joint, position (3), stiffness, damping
///     release        [pointer 0]
///     key            marks this moment, for a recorder that listens to the replies -> time_us, pose (its sequence)
///     reset          the initial pose at rest, all pointers released
///     step           lockstep only: [count 1], [pointer_sequence id sequence ...] -> steps (done in all)
///                    refused if the pointer message of this client with that sequence, or a later one, has not
///                    arrived; the pointers glide to their newest poses over the command's steps
///     get_character  publishes a character_t, and the newest pose once more
///     get_mesh       publishes mesh_chunk_t: [chunks index ...], all if left out -> chunks (their total)
///     shutdown       ends the server
///
/// A command that comes again (same client_id and sequence) gets the reply that it got, refusals too, and does nothing:
/// to try again what was refused, send it under a new sequence. Single-threaded, like the simulation that it commands.
class CommandProcessor {
 public:
  CommandProcessor(Simulation& simulation, PosePublisher& poses, MessageSink& sink, std::int64_t server_id);

  /// Publishes the reply, after what the command itself publishes.
  void handle(const command_t& command);
  void publish_character();
  [[nodiscard]] bool shutdown_requested() const { return shutdown_requested_; }

 private:
  using Action = void (CommandProcessor::*)(const command_t&, reply_t&);
  struct Entry {
    std::string_view name;
    Action action;
  };
  static const Entry* find(std::string_view name);

  [[nodiscard]] reply_t answer(const command_t& command);
  void carry_out(const command_t& command, reply_t& reply);
  void grab(const command_t& command, reply_t& reply);
  void release(const command_t& command, reply_t& reply);
  void key(const command_t& command, reply_t& reply);
  void reset(const command_t& command, reply_t& reply);
  void step(const command_t& command, reply_t& reply);
  void get_character(const command_t& command, reply_t& reply);
  void get_mesh(const command_t& command, reply_t& reply);
  void shutdown(const command_t& command, reply_t& reply);
  [[nodiscard]] int find_bone(const std::string& name) const;
  void require_pointer_message(const command_t& command, std::int64_t pointer, std::int64_t sequence) const;
  void publish_chunk(std::int32_t index);

  Simulation& simulation_;
  PosePublisher& poses_;
  MessageSink& sink_;
  std::int64_t server_id_;
  MeshChunks mesh_;
  ReplyCache replies_;
  bool shutdown_requested_{false};
};

}  // namespace layfigure::app
