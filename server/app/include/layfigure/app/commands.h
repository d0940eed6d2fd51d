#pragma once

#include <cstdint>
#include <layfigure/command_t.hpp>
#include <layfigure/reply_t.hpp>
#include <string_view>

#include "layfigure/app/arguments.h"
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
///     grab           bone, [point x y z]; or what is there: [reach 0.03], the skin nearest to the pointer, or a ray:
///                    origin x y z, direction x y z, as of a mouse. With all: [pointer 0], [stiffness], [damping],
///                    [mode "3dof" | "6dof"]; see haptics::Hands::grab and GrabRequest
///                    -> joint, position (3, world), point (3, in the bone's frame), stiffness, damping, and the
///                    distance from the pointer to the skin or along the ray
///     touch          [pointer 0], [radius 0.008], [friction 1], [stiffness], [damping], [magnet 0]: the pointer's
///                    fingertip comes out where the pointer is; see haptics::Hands::touch
///                    -> position (3), radius, stiffness, damping
///     release        [pointer 0]: puts its tool away, of both kinds
///     pin            bone, [point x y z], [mode "3dof" | "6dof"], [hold "stiff" | "rigid"]: fastens the bone to the
///                    world where it is; see haptics::Pins -> pin (its number), joint, position (3)
///     unpin          [pin, all if left out]
///     set            of a pointer [pointer 0], any of: scale s, of its translations; power_scale P, of what
///                    the hand feels beside what the world does; clutch 1 (the hand moves freely,
///                    the pointer stays) or 0; base x y z w x y z, the pose of its device in the world; magnet 1 or 0,
///                    of a fingertip that is out; see haptics::WorkspaceMap and haptics::Hands::set_magnet.
///                    Of the doll: softness f, times the yield torques while any pointer has a tool out, [bone, whose
///                    joint alone it is for; all joints' if left out]
///     key            marks this moment, for a recorder that listens to the replies -> time_us, pose (its sequence)
///     reset          the initial pose at rest, all pointers released, all pins gone
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
  void touch(const command_t& command, reply_t& reply);
  void release(const command_t& command, reply_t& reply);
  void pin(const command_t& command, reply_t& reply);
  void unpin(const command_t& command, reply_t& reply);
  void set(const command_t& command, reply_t& reply);
  [[nodiscard]] skinning::SkinPoint what_is_there(const Arguments& arguments, int pointer);
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
