#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "layfigure/app/simulation.h"
#include "layfigure/doll/doll.h"

namespace layfigure::app {

struct ServerSettings {
  SimulationSettings simulation;
  std::string lcm_url;                       ///< used unless there is a broker port
  std::optional<std::uint16_t> broker_port;  ///< serve LCM's tcpq on 127.0.0.1 here; 0: any free port
  std::string channel_prefix;
  std::vector<std::string> devices;                   ///< kinds (device/open.h), at most messaging::kMaxPointers
  haptics::PassivityOptions passivity;                ///< of the devices
  std::vector<std::filesystem::path> device_configs;  ///< none, one for all devices, or one for each
  std::filesystem::path character;                    ///< the file that the doll was made of
  std::optional<std::filesystem::path> log;           ///< write an event log of the session here
  std::optional<double> duration;                     ///< leave after so much wall-clock time [s], > 0
  std::int64_t server_id{0};                          ///< tells this run of a server from any other; random, not 0
};

/// A doll on the bus. Owns the broker, the bus and the loop that simulates, answers commands and publishes.
class Server {
 public:
  /// Opens the bus, the log and the devices. Throws messaging::BrokerError, BusError or LogError, or what
  /// device::open_driver() throws.
  Server(doll::Doll doll, ServerSettings settings);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Where clients find the server: an LCM URL.
  [[nodiscard]] const std::string& url() const;
  /// Serves until stop(), a shutdown command or the end of the duration; the last message is a status "leaving".
  void run();
  /// Ends run(). From any thread.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace layfigure::app
