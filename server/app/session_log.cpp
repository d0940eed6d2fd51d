#include "layfigure/app/session_log.h"

#include <layfigure/log_snapshot_t.hpp>
#include <layfigure/log_step_t.hpp>

#include "layfigure/app/messages.h"
#include "layfigure/app/options.h"
#include "layfigure/app/server.h"
#include "layfigure/cache/bytes.h"
#include "layfigure/cache/digest.h"

namespace layfigure::app {

std::string doll_hash(const doll::Doll& doll) {
  return cache::Digester()
      .add(cache::to_bytes(doll.definition))
      .add(cache::to_bytes(doll.root_pin))
      .add(cache::to_bytes(doll.carriers))
      .add(cache::to_bytes(doll.shapes))
      .add(cache::to_bytes(doll.never_touch))
      .value()
      .hex();
}

log_start_t make_log_start(const Simulation& simulation, const ServerSettings& settings) {
  log_start_t start{};
  start.protocol_version = messaging::kProtocolVersion;
  start.time_us = simulation.time_us();
  start.server_id = settings.server_id;
  start.program = program_version();
  start.character = std::filesystem::absolute(settings.character).string();
  start.content_hash = content_hash(simulation.doll());
  start.doll_hash = doll_hash(simulation.doll());
  start.physics_hz = settings.simulation.physics_hz;
  start.pose_hz = settings.simulation.pose_hz;
  start.clock = clock_name(settings.simulation.clock);
  start.devices = settings.devices;
  start.device_count = static_cast<std::int32_t>(start.devices.size());
  start.haptic_ticks = settings.simulation.haptic_ticks;
  std::vector<device::Info> infos;
  for (int k = 0; k < simulation.devices().count(); ++k) infos.push_back(simulation.devices().info(k));
  const std::string info_bytes = cache::to_bytes(infos);
  start.infos.assign(info_bytes.begin(), info_bytes.end());
  start.info_bytes = static_cast<std::int32_t>(info_bytes.size());
  const std::string bytes = cache::to_bytes(simulation.doll().settings);
  start.settings.assign(bytes.begin(), bytes.end());
  start.settings_bytes = static_cast<std::int32_t>(bytes.size());
  return start;
}

/// What follows takes effect at the present step.
void SessionLog::mark_step(const Simulation& simulation, bool failed) {
  if (simulation.steps() == marked_step_ && !failed) return;
  marked_step_ = simulation.steps();
  log_step_t step{};
  step.protocol_version = messaging::kProtocolVersion;
  step.time_us = simulation.time_us();
  step.step = simulation.steps();
  step.failed = failed;
  put(messaging::Channel::kLogStep, step);
}

void SessionLog::brought(const haptics::DeviceInput& input, const Simulation& simulation) {
  cache::write_bytes(input, input_);
  log_devices_t& message = devices_;
  message.protocol_version = messaging::kProtocolVersion;
  message.time_us = simulation.time_us();
  message.step = simulation.steps();
  message.bytes.assign(input_.begin(), input_.end());
  message.byte_count = static_cast<std::int32_t>(input_.size());
  messaging::encode(message, encoded_);
  log_.write_from_step(devices_channel_, encoded_);
}

std::optional<haptics::DollMemory> LoggedSnapshots::find(const std::string& name) {
  std::optional<haptics::DollMemory> found = snapshots_.find(name);
  if (log_ == nullptr) return found;
  log_snapshot_t message{};
  message.protocol_version = messaging::kProtocolVersion;
  message.time_us = simulation_.time_us();
  message.name = name;
  const std::string bytes = found ? cache::to_bytes(*found) : "";
  message.bytes.assign(bytes.begin(), bytes.end());
  message.byte_count = static_cast<std::int32_t>(bytes.size());
  log_->took(messaging::Channel::kLogSnapshot, message, simulation_);
  return found;
}

}  // namespace layfigure::app
