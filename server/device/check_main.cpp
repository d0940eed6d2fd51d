// layfigure-device-check: the conformance test of haptic devices, for whoever has one.
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

#include "layfigure/device/check.h"
#include "layfigure/device/open.h"
#include "layfigure/messaging/bus.h"

namespace {

using namespace layfigure;

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

constexpr const char* kExamples = R"(
Nobody's hand should be at the device: it is pushed.

Examples:
  layfigure-device-check spidar-g6                          the simulated SPIDAR
  layfigure-device-check spidar-g6 --device-config my.toml  a geometry file of one's own
  layfigure-device-check ./spacenav.so                      a plugin
  layfigure-device-check lcm --device-config left.toml      a process that speaks SPIDAR_STATE and SPIDAR_COMMAND

Exit code: 0 all passed, 1 something failed or the device does not open, 2 wrong usage.)";

void print(const device::CheckLine& line) {
  const char* result = line.result == device::CheckLine::Result::kPassed   ? "ok    "
                       : line.result == device::CheckLine::Result::kFailed ? "FAILED"
                                                                           : "      ";
  std::printf("%s  %s%s%s\n", result, line.what.c_str(), line.detail.empty() ? "" : ": ", line.detail.c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("layfigure-device-check"));
  spdlog::set_pattern("%n: %v");
  device::OpenSettings device;
  device::CheckSettings settings;
  device.bus_url = messaging::default_bus_url();
  CLI::App app("Checks that a haptic device keeps to what layfigure-server relies on.", "layfigure-device-check");
  app.footer(kExamples);
  app.set_version_flag("--version", "layfigure-device-check " LAYFIGURE_VERSION);
  app.add_option("DEVICE", device.kind, "spidar-g6, lcm or the path of a plugin.so")->required();
  app.add_option("--device-config", device.config, "its file: a geometry, or what the device itself takes");
  app.add_option("--seconds", settings.seconds, "to read for, and to wait for a first pose")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 3600.0));
  app.add_option("--lcm-url", device.bus_url, "the bus, for lcm")->capture_default_str();
  app.add_option("--channel-prefix", device.channel_prefix, "before the channels' names, for lcm")
      ->check([](const std::string& prefix) {
        return messaging::is_channel_prefix(prefix) ? "" : "expected letters, digits and underscores, at most 40";
      });
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& done) {
    return app.exit(done);
  } catch (const CLI::ParseError& error) {
    spdlog::error("{} (--help shows the options)", error.what());
    return kExitUsage;
  }
  try {
    return device::check_device([&] { return device::open_driver(device); }, settings, print) ? 0 : kExitFailed;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kExitFailed;
  }
}
