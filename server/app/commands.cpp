#include "layfigure/app/commands.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "layfigure/app/arguments.h"
#include "layfigure/app/messages.h"
#include "layfigure/app/results.h"
#include "layfigure/messaging/protocol.h"

namespace layfigure::app {

CommandProcessor::CommandProcessor(Simulation& simulation, PosePublisher& poses, MessageSink& sink,
                                   session::Snapshots& snapshots, std::int64_t server_id)
    : simulation_(simulation),
      poses_(poses),
      sink_(sink),
      snapshots_(snapshots),
      server_id_(server_id),
      mesh_(simulation.doll().rig) {}

const CommandProcessor::Entry* CommandProcessor::find(std::string_view name) {
  static constexpr auto kCommands = std::to_array<Entry>({{"grab", &CommandProcessor::grab},
                                                          {"touch", &CommandProcessor::touch},
                                                          {"release", &CommandProcessor::release},
                                                          {"pin", &CommandProcessor::pin},
                                                          {"unpin", &CommandProcessor::unpin},
                                                          {"set", &CommandProcessor::set},
                                                          {"lock", &CommandProcessor::lock},
                                                          {"unlock", &CommandProcessor::unlock},
                                                          {"load_pose", &CommandProcessor::load_pose},
                                                          {"undo", &CommandProcessor::undo},
                                                          {"redo", &CommandProcessor::redo},
                                                          {"history", &CommandProcessor::history},
                                                          {"snapshot", &CommandProcessor::snapshot},
                                                          {"mirror", &CommandProcessor::mirror},
                                                          {"key", &CommandProcessor::key},
                                                          {"reset", &CommandProcessor::reset},
                                                          {"step", &CommandProcessor::step},
                                                          {"get_character", &CommandProcessor::get_character},
                                                          {"get_joints", &CommandProcessor::get_joints},
                                                          {"get_mesh", &CommandProcessor::get_mesh},
                                                          {"shutdown", &CommandProcessor::shutdown}});
  const auto* found = std::ranges::find(kCommands, name, &Entry::name);
  return found == kCommands.end() ? nullptr : found;
}

void CommandProcessor::handle(const command_t& command) {
  if (const reply_t* known = replies_.find(command.client_id, command.sequence)) return sink_.publish(*known);
  const reply_t reply = answer(command);
  replies_.store(reply);
  if (asked_chunks_.empty()) return sink_.publish(reply);
  mesh_requests_.push_back({.chunks = std::exchange(asked_chunks_, {}), .reply = reply});
}

void CommandProcessor::refuse(const command_t& command, std::string reason) {
  if (const reply_t* known = replies_.find(command.client_id, command.sequence)) return sink_.publish(*known);
  reply_t reply = begin_reply(command);
  reply.reason = std::move(reason);
  replies_.store(reply);
  sink_.publish(reply);
}

reply_t CommandProcessor::begin_reply(const command_t& command) const {
  reply_t reply{};
  reply.protocol_version = messaging::kProtocolVersion;
  reply.time_us = simulation_.time_us();
  reply.server_id = server_id_;
  reply.client_id = command.client_id;
  reply.sequence = command.sequence;
  return reply;
}

reply_t CommandProcessor::answer(const command_t& command) {
  reply_t reply = begin_reply(command);
  try {
    carry_out(command, reply);
    reply.accepted = true;
  } catch (const std::invalid_argument& refusal) {  // a Refusal, or the simulation's
    reply.reason = refusal.what();
  }
  reply.time_us = simulation_.time_us();
  return reply;
}

void CommandProcessor::carry_out(const command_t& command, reply_t& reply) {
  if (command.protocol_version != messaging::kProtocolVersion) {
    throw Refusal("protocol version " + std::to_string(command.protocol_version) + ", this server speaks " +
                  std::to_string(messaging::kProtocolVersion));
  }
  if (replies_.is_too_old(command.client_id, command.sequence)) {
    throw Refusal("sequence " + std::to_string(command.sequence) +
                  " is too old to know whether it was carried out; sequences must grow");
  }
  const Entry* entry = find(command.name);
  if (entry == nullptr) throw Refusal("unknown command '" + command.name + "'");
  (this->*entry->action)(command, reply);
}

void CommandProcessor::key(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {});
  add_result(reply, "time_us", {static_cast<double>(simulation_.time_us())});
  add_result(reply, "pose", {static_cast<double>(poses_.count() - 1)});
}

void CommandProcessor::reset(const command_t& command, reply_t&) {
  const Arguments arguments(command, {"all"});
  const bool all = arguments.flag("all").value_or(false);
  simulation_.reset(all);
  if (all) publish_character();
}

void CommandProcessor::step(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"count", "pointer_sequence"});
  if (simulation_.settings().clock != ClockKind::kLockstep) {
    throw Refusal("step needs a server with --clock lockstep; this one runs in realtime");
  }
  if (!simulation_.failure().empty()) throw Refusal(simulation_.failure());
  const std::int64_t count = arguments.integer("count", 1, kMaxStepsPerCommand).value_or(1);
  const std::span<const double> awaited = arguments.integers("pointer_sequence");
  if (awaited.size() % 2 != 0) throw Refusal("argument 'pointer_sequence' is not pairs of pointer and sequence");
  for (std::size_t i = 0; i < awaited.size(); i += 2) {
    require_pointer_message(command, static_cast<std::int64_t>(awaited[i]), static_cast<std::int64_t>(awaited[i + 1]));
  }
  const std::int64_t before = simulation_.steps();
  simulation_.begin_motion(count);
  for (std::int64_t i = 0; i < count && simulation_.advance(); ++i) poses_.publish_if_due();
  if (simulation_.steps() == before) throw Refusal(simulation_.failure());
  add_result(reply, "steps", {static_cast<double>(simulation_.steps())});
}

void CommandProcessor::require_pointer_message(const command_t& command, std::int64_t pointer,
                                               std::int64_t sequence) const {
  std::string otherwise;
  for (const auto& [id, known] : simulation_.inputs()) {
    if (id != pointer) continue;
    if (known.client_id() != command.client_id) {
      otherwise = ", or client '" + known.client_id() + "' has moved the pointer since";
    } else if (known.sequence() >= sequence) {
      return;
    }
  }
  throw Refusal("pointer " + std::to_string(pointer) + ": message " + std::to_string(sequence) + " has not arrived" +
                otherwise + "; send it again");
}

void CommandProcessor::get_character(const command_t& command, reply_t&) {
  const Arguments arguments(command, {});
  publish_character();
  poses_.repeat_newest();
}

void CommandProcessor::publish_character() { sink_.publish(make_character(simulation_, server_id_, mesh_.bytes())); }

void CommandProcessor::get_mesh(const command_t& command, reply_t& reply) {
  const Arguments arguments(command, {"chunks"});
  const std::span<const double> wanted = arguments.integers("chunks");
  const auto total = static_cast<std::size_t>(mesh_.total());
  if (wanted.size() > total || std::ranges::any_of(wanted, [&](double index) { return index >= mesh_.total(); })) {
    throw Refusal("argument 'chunks' asks for more than there is, expected indices from 0 to " +
                  std::to_string(mesh_.total() - 1));
  }
  if (mesh_requests_.size() >= kMaxMeshRequests) {
    throw Refusal(std::to_string(kMaxMeshRequests) + " requests for the mesh are being served: try again");
  }
  asked_chunks_.resize(wanted.empty() ? total : wanted.size());
  if (wanted.empty()) std::iota(asked_chunks_.begin(), asked_chunks_.end(), 0);
  std::ranges::transform(wanted, asked_chunks_.begin(), [](double index) { return static_cast<std::int32_t>(index); });
  add_result(reply, "chunks", {static_cast<double>(mesh_.total())});
}

void CommandProcessor::send_mesh_chunk() {
  MeshRequest& request = mesh_requests_.front();
  publish_chunk(request.chunks[request.sent]);
  if (++request.sent < request.chunks.size()) return;
  sink_.publish(request.reply);
  mesh_requests_.pop_front();
}

void CommandProcessor::publish_chunk(std::int32_t index) {
  mesh_chunk_t message = mesh_.chunk(index);
  message.time_us = simulation_.time_us();
  message.server_id = server_id_;
  sink_.publish(message);
}

void CommandProcessor::shutdown(const command_t& command, reply_t&) {
  const Arguments arguments(command, {});
  shutdown_requested_ = true;
}

int CommandProcessor::find_bone(const std::string& name) const {
  const std::vector<character::Bone>& bones = simulation_.doll().rig.bones;
  const auto found = std::ranges::find(bones, name, &character::Bone::name);
  if (found == bones.end()) throw Refusal("no bone is called '" + name + "'");
  return static_cast<int>(found - bones.begin());
}

}  // namespace layfigure::app
