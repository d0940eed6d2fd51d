#include "layfigure/app/server.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "layfigure/app/commands.h"
#include "layfigure/app/message_sink.h"
#include "layfigure/app/messages.h"
#include "layfigure/app/pacer.h"
#include "layfigure/app/pose_publisher.h"
#include "layfigure/app/session_log.h"
#include "layfigure/device/open.h"
#include "layfigure/haptics/realtime_thread.h"
#include "layfigure/messaging/broker.h"
#include "layfigure/messaging/bus.h"
#include "layfigure/messaging/inbox.h"
#include "layfigure/messaging/protocol.h"

namespace layfigure::app {
namespace {

using Clock = std::chrono::steady_clock;
using messaging::Channel;

constexpr std::chrono::milliseconds kStatusInterval{100};
constexpr std::chrono::seconds kCharacterInterval{1};
// How long a haptic thread that is behind is waited for before it is asked again: a wake-up from a tick would be a
// lock.
constexpr std::chrono::microseconds kHapticPoll{100};
constexpr std::size_t kMaxEventsPerTurn = 16;  // then steps that are due have their turn: a flood does not stop time
constexpr int kMaxChunksPerTurn = 16;          // then messages have theirs
constexpr std::chrono::microseconds kChunkTime{100};  // enough to encode, log and queue a chunk of the mesh

class BusSink : public MessageSink {
 public:
  /// `log` may be null.
  BusSink(messaging::Bus& bus, SessionLog* log) : bus_(bus), log_(log) {}
  void publish(const pose_t& message) override { put(Channel::kPose, message); }
  void publish(const force_t& message) override { put(Channel::kForce, message); }
  void publish(const character_t& message) override { put(Channel::kCharacter, message); }
  void publish(const mesh_chunk_t& message) override { put(Channel::kMesh, message); }
  void publish(const reply_t& message) override { put(Channel::kReply, message); }
  void publish(const status_t& message) override { put(Channel::kStatus, message); }

 private:
  template <class Message>
  void put(Channel channel, const Message& message) {
    bus_.publish(channel, message);
    if (log_ != nullptr) log_->published(channel, message);
  }

  messaging::Bus& bus_;
  SessionLog* log_;
};

std::unique_ptr<SessionLog> make_log(const ServerSettings& settings) {
  return settings.log ? std::make_unique<SessionLog>(*settings.log, settings.channel_prefix) : nullptr;
}

std::unique_ptr<messaging::Broker> make_broker(const ServerSettings& settings) {
  return settings.broker_port ? std::make_unique<messaging::Broker>(*settings.broker_port) : nullptr;
}

/// Device k with its own config, or that of all.
haptics::DeviceHands open_devices(const ServerSettings& settings, const std::string& url) {
  std::vector<device::Device> devices;
  devices.reserve(settings.devices.size());
  for (std::size_t k = 0; k < settings.devices.size(); ++k) {
    const auto& configs = settings.device_configs;
    devices.push_back(device::open_device({.kind = settings.devices[k],
                                           .config = configs.empty() ? "" : configs[std::min(k, configs.size() - 1)],
                                           .index = static_cast<int>(k),
                                           .bus_url = url,
                                           .channel_prefix = settings.channel_prefix}));
    spdlog::info("pointer {} is moved by {}", k, devices.back().info().name);
  }
  return haptics::DeviceHands(std::move(devices), settings.passivity);
}

/// LCM has no way to tell who sends: whoever is reached can pose the doll.
void warn_of_network(const std::string& url) {
  const int ttl = messaging::multicast_ttl(url);
  if (ttl == 0) return;
  spdlog::warn(
      "{} has ttl={}: messages leave this machine, and anybody they reach can command this server; ttl=0 keeps "
      "them here",
      url, ttl);
}

void tell_broker(const messaging::Broker& broker, status_t& status) {
  status.bad_messages += broker.refused_clients();
  status.dropped_messages += broker.dropped_messages();
  status.paused_clients = broker.pauses();
  status.clients = broker.clients();
  status.max_clients = static_cast<std::int32_t>(messaging::kMaxClients);
}

/// To who has not said which server is meant.
std::string two_servers(std::int64_t id, std::int64_t rival) {
  return "two servers speak on this bus, " + std::to_string(id) + " and " + std::to_string(rival) +
         ": choose one with --server ID, stop the other, or give each its own --lcm-url or --channel-prefix";
}

messaging::Bus::Handlers make_handlers(messaging::Inbox& inbox) {
  return {{Channel::kPointer, [&](messaging::ByteView bytes) { inbox.receive_pointer(bytes); }},
          {Channel::kCommand, [&](messaging::ByteView bytes) { inbox.receive_command(bytes); }},
          {Channel::kStatus, [&](messaging::ByteView bytes) { inbox.receive_status(bytes); }}};
}

}  // namespace

struct Server::Impl {
  Impl(doll::Doll doll, ServerSettings server_settings);

  void run();
  void check_snapshots();
  [[nodiscard]] bool is_done(Clock::time_point now) const;
  [[nodiscard]] bool is_stepping() const;
  [[nodiscard]] bool is_resting() const;  ///< the doll does, while time goes on
  [[nodiscard]] Clock::time_point next_wake_up() const;
  [[nodiscard]] Clock::time_point next_step() const;
  [[nodiscard]] bool is_due(Clock::time_point now) const;
  [[nodiscard]] bool is_paced_by_haptics() const;
  void handle_events();
  void handle(const pointer_t& pointer);
  void handle(const command_t& command);
  void start_realtime();
  void run_due_steps();
  void send_mesh();
  [[nodiscard]] bool has_time_for_chunk() const;
  void publish_heartbeats(Clock::time_point now);
  void publish_status(bool leaving);
  void tell_scheduling(device_t& device) const;
  void report_dropped_time();

  const ServerSettings settings;
  std::atomic<bool> stopping{false};
  messaging::Inbox inbox;
  std::unique_ptr<messaging::Broker> broker;  // outlives the bus, so that it can deliver the bus's last messages
  const std::string url;
  std::unique_ptr<SessionLog> log;  // null: none is wanted
  messaging::Bus bus;
  BusSink sink;
  Simulation simulation;
  PosePublisher poses;
  session::SnapshotFile snapshot_file;
  LoggedSnapshots snapshots;
  CommandProcessor commands;
  Pacer pacer;
  haptics::RealtimeGrant realtime;  ///< of this thread
  double reported_dropped_time{0.0};
  Clock::time_point end{Clock::time_point::max()};
  Clock::time_point next_status{};
  Clock::time_point next_character{};
};

Server::Impl::Impl(doll::Doll doll, ServerSettings server_settings)
    : settings(std::move(server_settings)),
      inbox(settings.server_id),
      broker(make_broker(settings)),
      url(broker ? broker->url() : settings.lcm_url),
      log(make_log(settings)),
      bus({url, settings.channel_prefix, broker.get()}, make_handlers(inbox)),
      sink(bus, log.get()),
      simulation(std::move(doll), settings.simulation, open_devices(settings, url)),
      poses(simulation, sink, settings.server_id),
      snapshot_file(simulation.doll(), session::SnapshotFile::of_user(simulation.doll())),
      snapshots(snapshot_file, log.get(), simulation),
      commands(simulation, poses, sink, snapshots, settings.server_id),
      pacer(settings.simulation.physics_hz, Clock::now()) {}

/// At once, and not when one is wanted.
void Server::Impl::check_snapshots() {
  try {
    (void)snapshot_file.names();
  } catch (const session::SnapshotError& error) {
    spdlog::warn("{}", error.what());
  }
}

void Server::Impl::run() {
  warn_of_network(url);
  check_snapshots();
  start_realtime();
  const Clock::time_point start = Clock::now();
  if (settings.duration) {
    end = start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*settings.duration));
  }
  pacer.skip_to(start);
  if (log) log->begin(make_log_start(simulation, settings));
  if (log && !simulation.devices().empty()) {
    simulation.log_devices([this](const haptics::DeviceInput& input) { log->brought(input, simulation); });
  }
  publish_heartbeats(start);
  poses.publish_if_due();
  while (!is_done(Clock::now())) {
    handle_events();
    run_due_steps();
    publish_heartbeats(Clock::now());
    send_mesh();
    inbox.wait_until(next_wake_up());
  }
  publish_status(true);
}

/// A hand at a device feels a late step, and a late tick the more.
void Server::Impl::start_realtime() {
  if (settings.simulation.clock != ClockKind::kRealtime || simulation.devices().empty()) return;
  realtime = haptics::request_realtime(haptics::RealtimeThread::kPriority - 1);
  if (!realtime.refused.empty()) spdlog::warn("{}", realtime.refused);
  simulation.start_haptic_thread();
}

bool Server::Impl::is_done(Clock::time_point now) const {
  return stopping || commands.shutdown_requested() || now >= end;
}

bool Server::Impl::is_resting() const { return is_stepping() && simulation.resting(); }

/// A simulation that has failed still lets go of its devices.
bool Server::Impl::is_stepping() const {
  const bool goes_on = simulation.failure().empty() || !simulation.devices().empty();
  return settings.simulation.clock == ClockKind::kRealtime && goes_on;
}

Clock::time_point Server::Impl::next_wake_up() const {
  if (commands.shutdown_requested()) return Clock::time_point{};
  if (commands.is_sending_mesh() && has_time_for_chunk()) return Clock::time_point{};
  const Clock::time_point heartbeat = std::min({next_status, next_character, end});
  if (!is_stepping() || simulation.resting()) return heartbeat;
  return std::min(heartbeat, next_step());
}

bool Server::Impl::is_paced_by_haptics() const { return simulation.devices().grant() != nullptr; }

Clock::time_point Server::Impl::next_step() const {
  if (!is_paced_by_haptics()) return pacer.deadline();
  const std::chrono::duration<double> ready_at(simulation.devices().ready_at());
  return std::max(Clock::time_point(std::chrono::duration_cast<Clock::duration>(ready_at)), Clock::now() + kHapticPoll);
}

/// A haptic thread has the clock: it has dropped what time it could not keep up with.
bool Server::Impl::is_due(Clock::time_point now) const {
  return is_paced_by_haptics() ? simulation.ready() : pacer.deadline() <= now;
}

/// What wakes the resting doll finds it at the present time, and a last pose says that it has rested until then.
void Server::Impl::handle_events() {
  const bool rested = is_resting();
  if (rested) simulation.rest(pacer.pass_over(Clock::now()));
  for (const messaging::Inbox::Event& event : inbox.take(kMaxEventsPerTurn)) {
    std::visit([this](const auto& message) { handle(message); }, event);
  }
  if (rested && !simulation.resting()) poses.publish();
}

void Server::Impl::handle(const pointer_t& pointer) {
  if (pointer.server_id == 0 && inbox.rival() != 0) return;
  if (log) log->took(Channel::kPointer, pointer, simulation);
  point(pointer, simulation);
}

void Server::Impl::handle(const command_t& command) {
  const std::int64_t rival = command.server_id == 0 ? inbox.rival() : 0;
  if (rival != 0) return commands.refuse(command, two_servers(settings.server_id, rival));
  if (log) log->took(Channel::kCommand, command, simulation);
  commands.handle(command);
}

void Server::Impl::run_due_steps() {
  const Clock::time_point now = Clock::now();  // what becomes due meanwhile waits for the messages that came meanwhile
  while (is_stepping() && !simulation.resting() && is_due(now)) {
    pacer.begin_step(Clock::now());
    const bool failed_before = !simulation.failure().empty();
    if (!simulation.advance() && !failed_before) {
      spdlog::error("the simulation failed: {}", simulation.failure());
      if (log) log->failed(simulation);
    }
    poses.publish_if_due();
  }
  if (!is_stepping()) pacer.skip_to(now);
}

/// At least one chunk a turn: where every step is late, they would never go out.
void Server::Impl::send_mesh() {
  for (int sent = 0; sent < kMaxChunksPerTurn && commands.is_sending_mesh(); ++sent) {
    if (sent > 0 && !has_time_for_chunk()) return;
    commands.send_mesh_chunk();
  }
}

/// Before the next step.
bool Server::Impl::has_time_for_chunk() const {
  return !is_stepping() || simulation.resting() || Clock::now() + kChunkTime <= next_step();
}

void Server::Impl::publish_heartbeats(Clock::time_point now) {
  if (now >= next_status) {
    if (is_resting()) poses.publish();
    publish_status(false);
    next_status = now + kStatusInterval;
  }
  if (now >= next_character) {
    commands.publish_character();
    report_dropped_time();
    next_character = now + kCharacterInterval;
  }
}

void Server::Impl::publish_status(bool leaving) {
  status_t status = make_status(simulation, settings.server_id);
  if (leaving) status.state = messaging::kLeaving;
  status.poses = poses.count();
  status.late_steps = pacer.late_steps();
  for (device_t& device : status.devices) tell_scheduling(device);
  status.dropped_time = pacer.dropped_time();
  status.bad_messages = inbox.bad_messages();
  status.dropped_messages = bus.dropped_messages();
  status.max_message_bytes = static_cast<std::int32_t>(messaging::kMaxMessageBytes);
  status.max_message_rate = messaging::kMaxMessageRate;
  if (broker) tell_broker(*broker, status);
  sink.publish(status);
}

/// Of the thread that serves the devices.
void Server::Impl::tell_scheduling(device_t& device) const {
  const haptics::RealtimeGrant* grant = simulation.devices().grant();
  device.realtime = (grant != nullptr ? *grant : realtime).scheduled;
}

void Server::Impl::report_dropped_time() {
  if (pacer.dropped_time() == reported_dropped_time) return;
  reported_dropped_time = pacer.dropped_time();
  spdlog::warn(
      "the simulation fell behind the wall clock: {:.3f} s of its time dropped so far; a lower --physics-hz helps",
      reported_dropped_time);
}

Server::Server(doll::Doll doll, ServerSettings settings)
    : impl_(std::make_unique<Impl>(std::move(doll), std::move(settings))) {}

Server::~Server() = default;

const std::string& Server::url() const { return impl_->url; }

void Server::run() { impl_->run(); }

void Server::stop() {
  impl_->stopping = true;
  impl_->inbox.interrupt();
}

}  // namespace layfigure::app
