#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <layfigure/command_t.hpp>
#include <layfigure/reply_t.hpp>
#include <string_view>

#include "layfigure/app/arguments.h"
#include "layfigure/app/mesh_chunks.h"
#include "layfigure/app/message_sink.h"
#include "layfigure/app/pose_publisher.h"
#include "layfigure/app/reply_cache.h"
#include "layfigure/app/simulation.h"
#include "layfigure/session/snapshots.h"

namespace layfigure::app {

/// The most steps that one step command may ask for.
inline constexpr std::int64_t kMaxStepsPerCommand = 10000;

/// Carries out commands and answers each with a reply_t. A command that is unknown, has a wrong or unknown argument, or
/// cannot be done is refused with the reason, and nothing has changed. Arguments in brackets may be left out. What is
/// said to change the doll is a step of its history.
///
///     grab           bone, [point x y z]; or what is there: [reach 0.03], the skin nearest to the pointer, or a ray:
///                    origin x y z, direction x y z, as of a mouse. With all: [pointer 0], [stiffness], [damping],
///                    [mode "3dof" | "6dof"], [angular_stiffness, of 6dof]; see haptics::Hands::grab and GrabRequest
///                    -> joint, position (3, world), point (3, in the bone's frame), pointer (where it is: x y z
///                    w x y z; what is held follows it from here), stiffness, damping, and the distance from the
///                    pointer to the skin or along the ray
///     touch          [pointer 0], [radius 0.008], [friction 1], [stiffness], [damping], [magnet 0]: the pointer's
///                    fingertip comes out where the pointer is; see haptics::Hands::touch
///                    -> position (3), radius, stiffness, damping
///     release        [pointer 0]: puts its tool away, of both kinds
///     pin            bone, [point x y z], [mode "3dof" | "6dof"], [hold "stiff" | "rigid"]: fastens the bone to the
///                    world where it is; see haptics::Pins -> pin (its number), joint, position (3). Or action
///                    "list" -> the same of all pins, one after the other
///     unpin          [pin, all if left out]
///     set            of a pointer [pointer 0], any of: scale s, of its translations; power_scale P, of what
///                    the hand feels beside what the world does; clutch 1 (the hand moves freely,
///                    the pointer stays) or 0; base x y z w x y z, the pose of its device in the world; magnet 1 or 0,
///                    of a fingertip that is out; mode "3dof" or "6dof" [angular_stiffness], of a grab: the rotation
///                    is held no more, or from now on; see haptics::WorkspaceMap, haptics::Hands::set_magnet and
///                    set_holds_rotation.
///                    Of the doll: softness f, times the yield torques while any pointer has a tool out; gravity x y z;
///                    and what a settings file gives joints (joint_arguments.h). [bone: a name or a pattern with * and
///                    ?, whose joints these are for; all joints' if left out; not gravity] -> joints that were set
///     lock           bone (name or pattern), [axes "twist bend_y bend_z", of which any]: these joints turn no more;
///                    see haptics::Hands::lock -> joints
///     unlock         [bone], [axes], all if left out -> joints
///     load_pose      rotations w x y z ..., [joints index ..., all in their order if left out], [duration 0.5 s],
///                    [max_torque, N m], [hold 0]: turns joints to where pose_t has these rotations, over the duration,
///                    by drives that let go when all have arrived, or hold on; see haptics::PoseDrives. Again with
///                    other rotations, and so on, for a stream. The root and what has no joint that can turn stay. Or
///                    action "cancel"; or action "state" -> driven (number of joints), on_the_way (of them). Or action
///                    "put", rotations, [joints]: the doll is there at once, at rest, held against gravity, with its
///                    root where its pin holds it; see session::posed() -> as undo
///     undo           the doll as it was before the last step; see Simulation::history -> label of what was undone,
///                    steps that are left to undo, branches to do again, place: the number of where it is in the tree
///                    of what was done, released: pointers whose tools were put away
///     redo           [branch k]: what was undone last, or another branch -> the same
///     history        [action "state"] -> the same of where the doll is; label of what led there, "" where it began
///                    action "go", place: to any place that a reply has told, on whatever branch -> the same; refused
///                    if the place is forgotten (see session::History::kMaxSteps)
///     snapshot       name, [action "save" | "restore" | "remove"]; or action "list": kept beyond the server's end
///                    -> of list: a name each; of restore: as undo
///     mirror         [side "both" | "left" | "right", whose pose goes onto the other side] -> as undo
///     key            marks this moment, for a recorder that listens to the replies -> time_us, pose (its sequence)
///     reset          [all 0]: the initial pose at rest, all pointers released, all pins gone; with all 1 what was set
///                    of the doll is as it was made too
///     step           lockstep only: [count 1], [pointer_sequence id sequence ...] -> steps (done in all)
///                    refused if the pointer message of this client with that sequence, or a later one, has not
///                    arrived; the pointers glide to their newest poses over the command's steps
///     get_character  publishes a character_t, and the newest pose once more
///     get_joints     [bone (name or pattern), all joints if left out], [of "now" | "chosen", what build_doll() chose
///                    before the settings or anybody changed single joints] -> joints, and of each of them what
///                    add_joints() tells (joint_results.h)
///     get_mesh       publishes mesh_chunk_t: [chunks index ...], all if left out -> chunks (their total), behind them;
///                    refused while kMaxMeshRequests are being served
///     shutdown       ends the server
///
/// A command that comes again (same client_id and sequence) gets the reply that it got, refusals too, and does nothing:
/// to try again what was refused, send it under a new sequence. Single-threaded, like the simulation that it commands.
class CommandProcessor {
 public:
  static constexpr std::size_t kMaxMeshRequests = 64;  ///< that are not yet served whole

  CommandProcessor(Simulation& simulation, PosePublisher& poses, MessageSink& sink, session::Snapshots& snapshots,
                   std::int64_t server_id);

  /// Publishes the reply, after what the command itself publishes; that to get_mesh comes from send_mesh_chunk().
  void handle(const command_t& command);
  /// Answers that the command is not carried out, and why; one that was answered already gets its reply again.
  void refuse(const command_t& command, std::string reason);
  void publish_character();
  /// There are chunks of the mesh to be sent. They may be many megabytes: steps go on between them.
  [[nodiscard]] bool is_sending_mesh() const { return !mesh_requests_.empty(); }
  /// Publishes the next one, in the order in which they were asked for, and behind the last one of a request its reply.
  /// Some 20 us. Not unless is_sending_mesh().
  void send_mesh_chunk();
  [[nodiscard]] bool shutdown_requested() const { return shutdown_requested_; }

 private:
  using Action = void (CommandProcessor::*)(const command_t&, reply_t&);
  struct Entry {
    std::string_view name;
    Action action;
  };
  static const Entry* find(std::string_view name);
  /// What is left of a get_mesh.
  struct MeshRequest {
    std::vector<std::int32_t> chunks;
    std::size_t sent{0};
    reply_t reply;
  };

  [[nodiscard]] reply_t begin_reply(const command_t& command) const;
  [[nodiscard]] reply_t answer(const command_t& command);
  void carry_out(const command_t& command, reply_t& reply);
  void grab(const command_t& command, reply_t& reply);
  void touch(const command_t& command, reply_t& reply);
  void release(const command_t& command, reply_t& reply);
  void pin(const command_t& command, reply_t& reply);
  void list_pins(reply_t& reply) const;
  void unpin(const command_t& command, reply_t& reply);
  void set(const command_t& command, reply_t& reply);
  [[nodiscard]] skinning::SkinPoint what_is_there(const Arguments& arguments, int pointer);
  void lock(const command_t& command, reply_t& reply);
  void unlock(const command_t& command, reply_t& reply);
  void set_locks(const command_t& command, reply_t& reply, bool locked);
  void load_pose(const command_t& command, reply_t& reply);
  void put_pose(const Arguments& arguments, reply_t& reply);
  void undo(const command_t& command, reply_t& reply);
  void redo(const command_t& command, reply_t& reply);
  void history(const command_t& command, reply_t& reply);
  void snapshot(const command_t& command, reply_t& reply);
  void mirror(const command_t& command, reply_t& reply);
  void tell(const PutBack& done, reply_t& reply);
  void tell_place(const std::string& label, reply_t& reply) const;
  [[nodiscard]] std::vector<double> joints_named(const std::vector<int>& bones) const;
  void key(const command_t& command, reply_t& reply);
  void reset(const command_t& command, reply_t& reply);
  void step(const command_t& command, reply_t& reply);
  void get_character(const command_t& command, reply_t& reply);
  void get_joints(const command_t& command, reply_t& reply);
  void get_mesh(const command_t& command, reply_t& reply);
  void shutdown(const command_t& command, reply_t& reply);
  [[nodiscard]] int find_bone(const std::string& name) const;
  void require_pointer_message(const command_t& command, std::int64_t pointer, std::int64_t sequence) const;
  void publish_chunk(std::int32_t index);

  Simulation& simulation_;
  PosePublisher& poses_;
  MessageSink& sink_;
  session::Snapshots& snapshots_;
  std::int64_t server_id_;
  MeshChunks mesh_;
  std::vector<std::int32_t> asked_chunks_;  // of the command that is being handled
  std::deque<MeshRequest> mesh_requests_;
  ReplyCache replies_;
  bool shutdown_requested_{false};
};

}  // namespace layfigure::app
