#include "layfigure/app/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <iostream>
#include <optional>
#include <random>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "layfigure/device/open.h"
#include "layfigure/doll/settings.h"
#include "layfigure/messaging/bus.h"
#include "layfigure/messaging/protocol.h"

namespace layfigure::app {
namespace {

constexpr double kMinPhysicsHz = 10.0;
constexpr double kMaxPhysicsHz = 20000.0;
constexpr double kMaxHapticHz = 10000.0;
constexpr double kMinPoseHz = 0.1;
constexpr double kMaxDuration = 1e7;      // [s]
constexpr double kWholeTolerance = 1e-9;  // of a ratio of two rates that were written in decimals

constexpr const char* kExamples = R"(
Examples:
  layfigure-server doll.glb                                the doll in realtime on the default LCM bus
  layfigure-server doll.glb --broker 7700                  for clients with --lcm-url tcpq://127.0.0.1:7700
  layfigure-server doll.glb --broker 0 --clock lockstep    for scripts: time advances by step commands only
  layfigure-server doll.glb --log work.lcmlog              all that happens goes to a log ...
  layfigure-server --replay work.lcmlog                    ... and is played again, bit for bit
  layfigure-server doll.glb --device spidar-g6 --device spidar-g6    felt and moved by two hands, simulated
  layfigure-server doll.glb --device lcm --physics-hz 250 --haptic-hz 4000    a large doll, felt at a device's own rate
  layfigure-server --inspect doll.glb --json               what doll would be built, then exit
  layfigure-server --inspect doll.glb --write-settings     the same to doll.doll.toml, to be edited: it is then used

Exit codes: 0 done, 1 failed, 2 wrong usage.)";

/// Refuses what does not hold with "'TEXT' is " and what it is not.
CLI::Validator check(std::function<bool(const std::string&)> holds, std::string otherwise) {
  return CLI::Validator(
      [holds = std::move(holds), otherwise = std::move(otherwise)](const std::string& text) -> std::string {
        return holds(text) ? "" : "'" + text + "' is " + otherwise;
      },
      "");
}

/// The number that is all of the text.
template <class Number>
std::optional<Number> parse(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// Unlike CLI::Range it says what it expects, and refuses "nan".
CLI::Validator number_in(double min, double max) {
  std::ostringstream otherwise;
  otherwise << "not a number from " << min << " to " << max;
  return check(
      [=](const std::string& text) {
        const std::optional<double> value = parse<double>(text);
        return value && *value >= min && *value <= max;
      },
      otherwise.str());
}

CLI::Validator port_number() {
  return check([](const std::string& text) { return parse<std::uint16_t>(text).has_value(); },
               "not a port from 0 to 65535");
}

CLI::Validator one_of(std::vector<std::string> words, std::string otherwise) {
  return check([words = std::move(words)](const std::string& text) { return std::ranges::count(words, text) > 0; },
               std::move(otherwise));
}

CLI::Validator file_ending_in(const std::string& ending, const std::string& kind) {
  return check([=](const std::string& text) { return text.ends_with(ending); },
               "no " + kind + ": its name ends in " + ending);
}

CLI::Validator channel_prefix() {
  return check(messaging::is_channel_prefix, "not at most 40 letters, digits and underscores");
}

CLI::Validator device_kind() {
  return check([](const std::string& text) { return text == "none" || device::is_device_kind(text); },
               "not none, spidar-g6, spidar-g6x3, spidar-g6x4, spidar-g6x5, lcm or a PLUGIN.so");
}

CLI::Validator lcm_url() {
  return check([](const std::string& text) { return text.starts_with("udpm://") || text.starts_with("tcpq://"); },
               "not an LCM URL: udpm://ADDRESS:PORT?ttl=N or tcpq://HOST:PORT");
}

void add_simulation_options(CLI::App& app, Options& options, std::string& clock) {
  SimulationSettings& simulation = options.server.simulation;
  app.add_option("--clock", clock, "realtime or lockstep [realtime]")
      ->check(one_of({"realtime", "lockstep"}, "not realtime or lockstep"))
      ->type_name("CLOCK");
  app.add_option("--physics-hz", simulation.physics_hz, "physics steps per second of simulation time [1000]")
      ->check(number_in(kMinPhysicsHz, kMaxPhysicsHz))
      ->type_name("HZ");
  app.add_option("--pose-hz", simulation.pose_hz, "poses per second of simulation time, at most --physics-hz [60]")
      ->check(number_in(kMinPoseHz, kMaxPhysicsHz))
      ->type_name("HZ");
}

void add_bus_options(CLI::App& app, Options& options) {
  ServerSettings& server = options.server;
  CLI::Option* url = app.add_option("--lcm-url", server.lcm_url, "LCM bus [$LCM_DEFAULT_URL, else udpm with ttl=0]")
                         ->check(lcm_url())
                         ->type_name("URL");
  app.add_option("--broker", server.broker_port, "serve LCM's tcpq on 127.0.0.1:PORT; 0: any free port, printed")
      ->check(port_number())
      ->type_name("PORT")
      ->excludes(url);
  app.add_option("--channel-prefix", server.channel_prefix, "put before every channel's name, to share a bus")
      ->check(channel_prefix())
      ->type_name("P");
  app.add_flag("--end-with-input", options.ends_with_input,
               "leave when standard input ends: with the program that started the server, however that ends");
  app.add_option("--duration", server.duration, "leave after S seconds of wall-clock time")
      ->check(number_in(1e-3, kMaxDuration))
      ->type_name("S");
}

void add_device_options(CLI::App& app, ServerSettings& server, double& haptic_hz, std::string& passivity) {
  CLI::Option* devices =
      app.add_option("--device", server.devices,
                     "haptic device: none, spidar-g6 (simulated), lcm (its own process) or PLUGIN.so; the first moves "
                     "pointer 0, the second pointer 1, ... [none]")
          ->check(device_kind())
          ->type_name("KIND")
          ->take_all()
          ->expected(1);
  app.add_option("--device-config", server.device_configs,
                 "of the devices, in their order, or one for all: a geometry for spidar-g6, else see the device")
      ->type_name("FILE")
      ->take_all()
      ->expected(1)
      ->needs(devices);
  app.add_option("--haptic-hz", haptic_hz,
                 "of the devices, a whole multiple of --physics-hz: between steps hands feel a local model of the doll "
                 "[--physics-hz]")
      ->check(number_in(kMinPhysicsHz, kMaxHapticHz))
      ->type_name("HZ")
      ->needs(devices);
  app.add_option("--passivity", passivity,
                 "damping where a device would put out energy that its hand, or all together, did not put in: off, "
                 "each or together [off]")
      ->check(one_of({"off", "each", "together"}, "not off, each or together"))
      ->type_name("WHOSE")
      ->needs(devices);
}

void add_inspect_options(CLI::App& app, Options& options, std::filesystem::path& settings_target) {
  CLI::Option* inspect = app.add_flag("--inspect", options.inspect, "print what doll would be built, and exit");
  CLI::Option* json = app.add_flag("--json", options.json, "with --inspect: as JSON")->needs(inspect);
  app.add_flag("--geometry", options.geometry, "with --json: with the skin by bodies, sections and ellipsoids")
      ->needs(json);
  CLI::Option* write =
      app.add_option("--write-settings", settings_target,
                     "with --inspect: every value of the doll as settings, to FILE [CHARACTER.doll.toml]")
          ->expected(0, 1)
          ->check(file_ending_in(".toml", "settings file"))
          ->type_name("[FILE.toml]")
          ->needs(inspect);
  app.add_flag("--force", options.force, "with --write-settings: replace a file that is there")->needs(write);
}

void add_character_options(CLI::App& app, Options& options, bool replays) {
  app.add_option("CHARACTER", options.character, "rigged character: glTF, FBX, Collada, ...")
      ->required(!replays)
      ->type_name("FILE");
  app.add_option("--doll", options.doll_settings, "how to make a doll of it [CHARACTER.doll.toml, if there is one]")
      ->type_name("SETTINGS.toml");
}

void add_log_options(CLI::App& app, Options& options) {
  CLI::Option* log =
      app.add_option("--log", options.server.log, "write all that is taken in and published to FILE, an LCM event log")
          ->check(file_ending_in(".lcmlog", "event log"))
          ->type_name("FILE.lcmlog");
  app.add_option("--replay", options.replay,
                 "play such a log again, as fast as can be, and compare every pose; CHARACTER may be left out")
      ->type_name("FILE.lcmlog")
      ->excludes(log);
}

void check_character(const Options& options) {
  if (options.character.empty() && !options.replay) throw CLI::RequiredError("CHARACTER");
  if (options.replay && options.inspect) throw CLI::ValidationError("--replay: does not go with --inspect");
}

void check_rates(const SimulationSettings& simulation) {
  if (simulation.pose_hz <= simulation.physics_hz) return;
  std::ostringstream message;
  message << "--pose-hz: " << simulation.pose_hz << " is more than --physics-hz, " << simulation.physics_hz;
  throw CLI::ValidationError(message.str());
}

void check_devices(const ServerSettings& server) {
  const std::size_t devices = server.devices.size();
  const std::size_t configs = server.device_configs.size();
  if (devices > static_cast<std::size_t>(messaging::kMaxPointers)) {
    throw CLI::ValidationError("--device: " + std::to_string(devices) + " devices are more than there are pointers, " +
                               std::to_string(messaging::kMaxPointers));
  }
  if (configs > 1 && configs != devices) {
    throw CLI::ValidationError("--device-config: " + std::to_string(configs) + " files for " + std::to_string(devices) +
                               " devices, expected one for all or one for each");
  }
}

/// Ticks come between steps: so many in each.
void set_haptic_rate(double haptic_hz, ServerSettings& server) {
  SimulationSettings& simulation = server.simulation;
  const double ticks = haptic_hz / simulation.physics_hz;
  std::ostringstream message;
  if (ticks < 1.0 || std::abs(ticks - std::round(ticks)) > kWholeTolerance * ticks) {
    message << "--haptic-hz: " << haptic_hz << " is not a whole multiple of --physics-hz, " << simulation.physics_hz;
    throw CLI::ValidationError(message.str());
  }
  simulation.haptic_ticks = static_cast<int>(std::lround(ticks));
  if (simulation.haptic_ticks > 1 && server.devices.size() > haptics::kMostPointers) {
    message << "--haptic-hz: " << server.devices.size() << " devices are more than can be served between steps, "
            << haptics::kMostPointers << "; leave it out";
    throw CLI::ValidationError(message.str());
  }
}

haptics::PassivityOptions::Judge passivity_judge(const std::string& whose) {
  using Judge = haptics::PassivityOptions::Judge;
  return whose == "each" ? Judge::kEach : whose == "together" ? Judge::kTogether : Judge::kOff;
}

/// Names a run of a server; 0 would look like none.
std::int64_t random_server_id() {
  std::random_device device;
  return std::uniform_int_distribution<std::int64_t>(1, std::numeric_limits<std::int64_t>::max())(device);
}

}  // namespace

std::string program_version() { return "layfigure-server " LAYFIGURE_VERSION; }

ParsedOptions parse_options(int argc, const char* const* argv) {
  CLI::App app("Simulates a rigged character as an elasto-plastic doll and serves it over LCM.", "layfigure-server");
  app.footer(kExamples);
  app.set_version_flag("--version", program_version());
  Options options;
  std::string clock = "realtime";
  std::filesystem::path settings_target;
  const bool replays =
      std::any_of(argv, argv + argc, [](std::string_view argument) { return argument.starts_with("--replay"); });
  add_character_options(app, options, replays);
  add_inspect_options(app, options, settings_target);
  add_simulation_options(app, options, clock);
  double haptic_hz = 0.0;
  std::string passivity = "off";
  add_device_options(app, options.server, haptic_hz, passivity);
  add_bus_options(app, options);
  add_log_options(app, options);
  try {
    app.parse(argc, argv);
    check_character(options);
    std::erase(options.server.devices, "none");
    check_rates(options.server.simulation);
    check_devices(options.server);
    if (app.count("--haptic-hz") > 0) set_haptic_rate(haptic_hz, options.server);
  } catch (const CLI::Success& wish) {
    return {std::nullopt, app.exit(wish)};
  } catch (const CLI::ParseError& error) {
    std::cerr << "layfigure-server: " << error.what() << " (see --help)\n";
    return {std::nullopt, kExitUsage};
  }
  if (app.count("--write-settings") > 0) {
    options.write_settings = settings_target.empty() ? doll::settings_path_beside(options.character) : settings_target;
  }
  options.server.passivity.judge = passivity_judge(passivity);
  options.server.simulation.clock = clock == "lockstep" ? ClockKind::kLockstep : ClockKind::kRealtime;
  if (options.server.lcm_url.empty()) options.server.lcm_url = messaging::default_bus_url();
  options.server.character = options.character;
  options.server.server_id = random_server_id();
  return {std::move(options), kExitDone};
}

}  // namespace layfigure::app
