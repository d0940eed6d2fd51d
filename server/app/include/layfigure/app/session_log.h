#pragma once

#include <cstdint>
#include <filesystem>
#include <layfigure/log_devices_t.hpp>
#include <layfigure/log_start_t.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "layfigure/app/simulation.h"
#include "layfigure/messaging/event_log.h"
#include "layfigure/messaging/protocol.h"
#include "layfigure/session/snapshots.h"

namespace layfigure::app {

struct ServerSettings;

/// Tells one doll from another: what its physics is made of. O(bodies + shapes).
[[nodiscard]] std::string doll_hash(const doll::Doll& doll);

/// The first event of the log of a server that begins.
[[nodiscard]] log_start_t make_log_start(const Simulation& simulation, const ServerSettings& settings);

/// A session as an LCM event log: what the server took in, of messages and of haptic devices, in the order and with
/// the step in which it took effect, and what it published, on the channels that it had on the bus. So it can be played
/// again, bit for bit (replay.h).
class SessionLog {
 public:
  /// Throws messaging::LogError.
  SessionLog(const std::filesystem::path& path, std::string channel_prefix)
      : log_(path),
        prefix_(std::move(channel_prefix)),
        devices_channel_(messaging::channel_name(prefix_, messaging::Channel::kLogDevices)) {}

  void begin(const log_start_t& start) { put(messaging::Channel::kLogStart, start); }
  /// A message that takes effect now.
  template <class Message>
  void took(messaging::Channel channel, const Message& message, const Simulation& simulation) {
    mark_step(simulation, false);
    put(channel, message);
  }
  template <class Message>
  void published(messaging::Channel channel, const Message& message) {
    put(channel, message);
  }
  /// The step that the simulation is at began with this. For where the step runs: allocates only for more than ever
  /// before, and as EventLogWriter::write_from_step() does.
  void brought(const haptics::DeviceInput& input, const Simulation& simulation);
  /// The simulation tried its next step in vain.
  void failed(const Simulation& simulation) { mark_step(simulation, true); }

 private:
  template <class Message>
  void put(messaging::Channel channel, const Message& message) {
    log_.write(messaging::channel_name(prefix_, channel), messaging::encode(message));
  }
  void mark_step(const Simulation& simulation, bool failed);

  messaging::EventLogWriter log_;
  std::string prefix_;
  std::int64_t marked_step_{-1};
  // brought()'s own, so that it finds their room again
  const std::string devices_channel_;
  std::string input_;
  log_devices_t devices_{};
  messaging::Bytes encoded_;
};

/// Snapshots of which those that are asked for go to the log, if there is one, after the command that asks.
class LoggedSnapshots : public session::Snapshots {
 public:
  /// Both must outlive this.
  LoggedSnapshots(session::Snapshots& snapshots, SessionLog* log, const Simulation& simulation)
      : snapshots_(snapshots), log_(log), simulation_(simulation) {}

  [[nodiscard]] std::vector<std::string> names() override { return snapshots_.names(); }
  [[nodiscard]] std::optional<haptics::DollMemory> find(const std::string& name) override;
  void save(const std::string& name, const haptics::DollMemory& memory) override { snapshots_.save(name, memory); }
  [[nodiscard]] bool remove(const std::string& name) override { return snapshots_.remove(name); }

 private:
  session::Snapshots& snapshots_;
  SessionLog* log_;
  const Simulation& simulation_;
};

}  // namespace layfigure::app
