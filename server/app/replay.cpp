#include "layfigure/app/replay.h"

#include <cmath>
#include <deque>
#include <layfigure/log_devices_t.hpp>
#include <layfigure/log_snapshot_t.hpp>
#include <layfigure/log_step_t.hpp>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "layfigure/app/commands.h"
#include "layfigure/app/messages.h"
#include "layfigure/app/options.h"
#include "layfigure/app/pose_publisher.h"
#include "layfigure/app/session_log.h"
#include "layfigure/app/simulation.h"
#include "layfigure/cache/bytes.h"

namespace layfigure::app {
namespace {

using messaging::Channel;

/// The message of an event that a log of ours wrote; nothing if its bytes are none.
template <class Message>
std::optional<Message> decode(const messaging::Bytes& bytes) {
  Message message;
  const int size = static_cast<int>(bytes.size());
  return message.decode(bytes.data(), 0, size) == size ? std::optional(std::move(message)) : std::nullopt;
}

/// Of the devices that the session had; none where the bytes are none.
std::vector<device::Info> device_infos(const log_start_t& start) {
  try {
    return cache::from_bytes<std::vector<device::Info>>(
        {reinterpret_cast<const char*>(start.infos.data()), start.infos.size()});
  } catch (const std::runtime_error&) {
    return {};
  }
}

/// Those that the log has told.
class LogSnapshots : public session::Snapshots {
 public:
  [[nodiscard]] std::vector<std::string> names() override { return {}; }
  [[nodiscard]] std::optional<haptics::DollMemory> find(const std::string& name) override {
    const auto known = told_.find(name);
    return known == told_.end() ? std::nullopt : std::optional(known->second);
  }
  void save(const std::string&, const haptics::DollMemory&) override {}
  [[nodiscard]] bool remove(const std::string&) override { return true; }
  void tell(const log_snapshot_t& message) {
    told_.erase(message.name);
    if (message.byte_count == 0) return;
    const std::string_view bytes(reinterpret_cast<const char*>(message.bytes.data()), message.bytes.size());
    told_.emplace(message.name, cache::from_bytes<haptics::DollMemory>(bytes));
  }

 private:
  std::map<std::string, haptics::DollMemory> told_;
};

/// Keeps the poses that commands publish, without repetitions.
class PoseSink : public MessageSink {
 public:
  void publish(const pose_t& message) override {
    if (message.sequence <= last_) return;
    last_ = message.sequence;
    poses.push_back(message);
  }
  void publish(const force_t&) override {}
  void publish(const character_t&) override {}
  void publish(const mesh_chunk_t&) override {}
  void publish(const reply_t&) override {}
  void publish(const status_t&) override {}

  std::deque<pose_t> poses;

 private:
  std::int64_t last_{-1};
};

/// What differs most between two poses of one doll, one line.
std::string difference_of(const pose_t& logged, const pose_t& now, const doll::Doll& doll) {
  const std::string where = "pose " + std::to_string(logged.sequence) + ", step " + std::to_string(logged.step) + ": ";
  if (logged.step != now.step) return where + "comes out at step " + std::to_string(now.step);
  if (logged.joint_count != now.joint_count) return where + "has another number of joints";
  for (std::int32_t j = 0; j < logged.joint_count; ++j) {
    double most = 0.0;
    for (int k = 0; k < 4; ++k) {
      most = std::max(most, std::abs(logged.rotations[j][k] - now.rotations[j][k]));
      most = std::max(most, std::abs(logged.rest_rotations[j][k] - now.rest_rotations[j][k]));
    }
    if (most > 0.0) return where + "'" + doll.rig.bones[j].name + "' differs by " + std::to_string(most) + " rad or so";
  }
  return where + "torques, flow or the root's position differ";
}

/// Why the replay cannot go on in the middle of something: the log was cut off there, or is not what is played.
struct Halt {
  std::string difference;  ///< "": none
};

/// What the devices brought, read from the log beside the Player, which reads what led to it. One per step.
class LogDevices {
 public:
  LogDevices(const std::filesystem::path& log, std::string channel, int bodies, int devices, bool served)
      : log_(log), channel_(std::move(channel)), bodies_(bodies), devices_(devices), served_(served) {}

  /// Throws Halt.
  [[nodiscard]] haptics::DeviceInput next(std::int64_t step);

 private:
  [[nodiscard]] bool is_sound(const haptics::DeviceInput& input) const;

  messaging::EventLogReader log_;
  std::string channel_;
  int bodies_;
  int devices_;
  bool served_;
};

haptics::DeviceInput LogDevices::next(std::int64_t step) {
  std::optional<messaging::LogEvent> event = log_.next();
  while (event && event->channel != channel_) event = log_.next();
  const std::optional<log_devices_t> message = event ? decode<log_devices_t>(event->bytes) : std::nullopt;
  if (!message) throw Halt{};
  const std::string where = "step " + std::to_string(step + 1) + ": ";
  if (message->step != step) {
    throw Halt{where + "the log has what devices brought into step " + std::to_string(message->step + 1)};
  }
  try {
    auto input = cache::from_bytes<haptics::DeviceInput>(
        {reinterpret_cast<const char*>(message->bytes.data()), message->bytes.size()});
    if (is_sound(input)) return input;
  } catch (const std::runtime_error&) {
    // as below
  }
  throw Halt{where + "what devices brought cannot be read"};
}

/// Nothing in it leads out of the doll.
bool LogDevices::is_sound(const haptics::DeviceInput& input) const {
  const auto is_pointer = [&](int pointer) { return pointer >= 0 && pointer < devices_; };
  const auto fits = [&](const haptics::PortLoad& load) {
    if (load.pointer < 0) return load.port.body >= 0 && load.port.body < bodies_;
    return is_pointer(load.pointer) && load.port.body >= 0;
  };
  const std::size_t tools = served_ && input.arrived ? haptics::kMostPointers : 0;
  return input.hands.size() == static_cast<std::size_t>(devices_) && input.tools.size() >= tools &&
         input.tools.size() <= haptics::kMostPointers && input.loads.size() <= haptics::kMostPorts &&
         std::ranges::all_of(input.loads, fits);
}

class Player {
 public:
  Player(doll::Doll doll, const log_start_t& start, const std::string& prefix, const std::filesystem::path& log)
      : start_(start),
        prefix_(prefix),
        lockstep_(start.clock == clock_name(ClockKind::kLockstep)),
        log_devices_(log, messaging::channel_name(prefix, Channel::kLogDevices),
                     static_cast<int>(doll.definition.bodies.size()), start.device_count, start.haptic_ticks > 1),
        simulation_(
            std::move(doll),
            {.physics_hz = start.physics_hz,
             .haptic_ticks = start.haptic_ticks,
             .pose_hz = start.pose_hz,
             .clock = lockstep_ ? ClockKind::kLockstep : ClockKind::kRealtime},
            haptics::DeviceHands(device_infos(start), [this] { return log_devices_.next(simulation_.steps()); })),
        poses_(simulation_, sink_, start.server_id),
        commands_(simulation_, poses_, sink_, snapshots_, start.server_id) {
    if (start.device_count > 0) simulation_.start_haptic_thread();
    if (lockstep_) poses_.publish_if_due();
  }

  /// False where the replay has left the log's way, or cannot go on.
  [[nodiscard]] bool try_to_play(const messaging::LogEvent& event);
  [[nodiscard]] ReplayReport report() {
    report_.steps = simulation_.steps();
    return report_;
  }

 private:
  [[nodiscard]] bool play(const messaging::LogEvent& event);
  [[nodiscard]] bool is_on(const messaging::LogEvent& event, Channel channel) const {
    return event.channel == messaging::channel_name(prefix_, channel);
  }
  [[nodiscard]] bool differs(std::string why) {
    report_.difference = std::move(why);
    return false;
  }
  [[nodiscard]] bool go_to(std::int64_t step);
  [[nodiscard]] bool play(const log_step_t& step);
  [[nodiscard]] bool compare(const pose_t& logged);

  const log_start_t& start_;
  const std::string& prefix_;
  bool lockstep_;
  PoseSink sink_;
  LogSnapshots snapshots_;
  LogDevices log_devices_;
  Simulation simulation_;
  PosePublisher poses_;
  CommandProcessor commands_;
  std::optional<command_t> asked_;  ///< carried out before the next event, which may tell the snapshot that it asks for
  doll::SkeletonPose skeleton_;
  std::int64_t last_pose_{-1};
  ReplayReport report_;
};

bool Player::try_to_play(const messaging::LogEvent& event) {
  try {
    return play(event);
  } catch (const Halt& halt) {
    report_.difference = halt.difference;
    return false;
  }
}

bool Player::play(const messaging::LogEvent& event) {
  if (is_on(event, Channel::kLogSnapshot)) {
    if (const auto snapshot = decode<log_snapshot_t>(event.bytes)) snapshots_.tell(*snapshot);
  }
  if (asked_) commands_.handle(*std::exchange(asked_, std::nullopt));
  if (is_on(event, Channel::kLogStep)) {
    const auto step = decode<log_step_t>(event.bytes);
    return !step || play(*step);
  }
  if (is_on(event, Channel::kPointer)) {
    const auto pointer = messaging::decode_pointer(event.bytes);
    if (pointer.message) point(*pointer.message, simulation_);
  } else if (is_on(event, Channel::kCommand)) {
    asked_ = messaging::decode_command(event.bytes).message;
  } else if (is_on(event, Channel::kPose)) {
    const auto pose = decode<pose_t>(event.bytes);
    return !pose || compare(*pose);
  }
  return true;
}

bool Player::play(const log_step_t& step) {
  if (!go_to(step.step)) return false;
  if (!step.failed || !simulation_.advance()) return true;
  return differs("step " + std::to_string(step.step + 1) + " was not finite in the log, and is now");
}

/// The steps of a realtime server; those in lockstep are made by commands.
bool Player::go_to(std::int64_t step) {
  if (simulation_.steps() > step || (lockstep_ && simulation_.steps() < step)) {
    return differs("the log is at step " + std::to_string(step) + ", the replay at step " +
                   std::to_string(simulation_.steps()));
  }
  while (simulation_.steps() < step) {
    if (simulation_.resting()) {
      simulation_.rest(step - simulation_.steps());
    } else if (!simulation_.advance()) {
      return differs(simulation_.failure() + ", but the log goes on");
    }
  }
  return true;
}

bool Player::compare(const pose_t& logged) {
  if (logged.sequence <= last_pose_) return true;  // repeated, for who has just come
  last_pose_ = logged.sequence;
  pose_t now;
  if (lockstep_) {
    if (sink_.poses.empty()) return differs("pose " + std::to_string(logged.sequence) + " does not come out");
    now = std::move(sink_.poses.front());
    sink_.poses.pop_front();
  } else {
    if (!go_to(logged.step)) return false;
    now = make_pose(simulation_, start_.server_id, logged.sequence, skeleton_);
  }
  if (messaging::encode(now) != messaging::encode(logged)) {
    return differs(difference_of(logged, now, simulation_.doll()));
  }
  ++report_.poses;
  return true;
}

}  // namespace

Replay::Replay(const std::filesystem::path& log) : log_(log), path_(log.string()) {
  const std::optional<messaging::LogEvent> first = log_.next();
  const std::string name = messaging::channel_name("", Channel::kLogStart);
  const bool is_ours = first && first->channel.ends_with(name);
  const std::optional<log_start_t> start = is_ours ? decode<log_start_t>(first->bytes) : std::nullopt;
  if (!start) {
    throw ReplayError("'" + path_ + "' is no log of a server's session: make one with --log" +
                      (is_ours ? ", of this version" : ""));
  }
  start_ = *start;
  prefix_ = first->channel.substr(0, first->channel.size() - name.size());
  if (start_.protocol_version != messaging::kProtocolVersion || start_.program != program_version()) {
    throw ReplayError("'" + path_ + "' is of " + start_.program + ", protocol " +
                      std::to_string(start_.protocol_version) + "; this is " + program_version() + ", protocol " +
                      std::to_string(messaging::kProtocolVersion) + ": play it with that one");
  }
  if (start_.haptic_ticks < 1 || start_.device_count > messaging::kMaxPointers ||
      (start_.haptic_ticks > 1 && start_.device_count > haptics::kMostPointers) ||
      device_infos(start_).size() != static_cast<std::size_t>(start_.device_count)) {
    throw ReplayError("'" + path_ + "' tells of haptic devices that cannot be: it is damaged");
  }
}

doll::DollSettings Replay::doll_settings() const {
  try {
    return cache::from_bytes<doll::DollSettings>(
        {reinterpret_cast<const char*>(start_.settings.data()), start_.settings.size()});
  } catch (const std::runtime_error&) {
    throw ReplayError("'" + path_ + "' has settings of another build of the program: play it with that one");
  }
}

ReplayReport Replay::run(doll::Doll doll) {
  if (content_hash(doll) != start_.content_hash) {
    throw ReplayError("'" + path_ + "' is of another character, '" + start_.character + "' as it was then");
  }
  if (doll_hash(doll) != start_.doll_hash) {
    throw ReplayError("'" + path_ + "' is of another doll of this character: another build of the program made it");
  }
  Player player(std::move(doll), start_, prefix_, path_);
  for (std::optional<messaging::LogEvent> event = log_.next(); event; event = log_.next()) {
    if (!player.try_to_play(*event)) break;
  }
  return player.report();
}

}  // namespace layfigure::app
