#include "layfigure/device/open.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "layfigure/device/check.h"
#include "layfigure/messaging/broker.h"
#include "layfigure/messaging/bus.h"
#include "layfigure/spidar/geometry.h"

namespace layfigure::device {
namespace {

namespace fs = std::filesystem;

OpenSettings settings(const std::string& kind, const fs::path& config = {}, const std::string& url = {}) {
  return {.kind = kind, .config = config, .index = 0, .bus_url = url, .channel_prefix = ""};
}

/// The message that opening is refused with.
std::string refusal(const OpenSettings& wanted) {
  try {
    (void)open_driver(wanted);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

void expect_refusal(const OpenSettings& wanted, const std::string& part) {
  const std::string message = refusal(wanted);
  EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, const std::string& text)
      : path_(fs::temp_directory_path() / ("layfigure-" + std::to_string(getpid()) + "-" + name)) {
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() { fs::remove(path_); }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Whether the conformance test passes; the lines that failed.
std::pair<bool, std::string> checked(const OpenSettings& wanted, double seconds = 0.3) {
  std::string failed;
  const bool passed = check_device([&] { return open_driver(wanted); }, {.seconds = seconds, .tick = 2.5e-4},
                                   [&](const CheckLine& line) {
                                     if (line.result == CheckLine::Result::kFailed) failed += line.what + "\n";
                                   });
  return {passed, failed};
}

TEST(OpenDevice, BuiltInSpidars_OpenAndKeepToTheRules) {
  for (const char* kind : {"spidar-g6", "spidar-g6x3", "spidar-g6x4", "spidar-g6x5"}) {
    EXPECT_TRUE(is_device_kind(kind));
    const auto [passed, failed] = checked(settings(kind));
    EXPECT_TRUE(passed) << kind << ":\n" << failed;
  }
}

TEST(OpenDevice, GeometryFile_IsWhatTheSpidarIs) {
  const fs::path file = fs::path(LAYFIGURE_SPIDAR_FILES) / "g6x5.toml";
  EXPECT_EQ(open_driver(settings("spidar-g6", file))->info().name, "SPIDAR-G6X5 (simulated)");
  EXPECT_EQ(open_driver(settings("spidar-g6"))->info().name, "SPIDAR-G6X3 (simulated)");
}

TEST(OpenDevice, Unknown_RefusedInOneLine) {
  EXPECT_FALSE(is_device_kind("none"));
  EXPECT_FALSE(is_device_kind("mouse"));
  expect_refusal(settings("mouse"), "--device mouse: expected none, spidar-g6");
  expect_refusal(settings("spidar-g6", "/no/such.toml"), "no such geometry file");
  expect_refusal(settings("spidar-g6x4", "/some.toml"), "use --device spidar-g6");
  expect_refusal(settings("/no/such.so"), "/no/such.so: there is no such plugin");
}

TEST(Plugin, Good_KeepsToTheRules) {
  const auto [passed, failed] = checked(settings(LAYFIGURE_TEST_PLUGINS "/good.so"));
  EXPECT_TRUE(passed) << failed;
  const auto driver = open_driver(settings(LAYFIGURE_TEST_PLUGINS "/good.so"));
  EXPECT_EQ(driver->info().name, "test plugin");
  const Reading reading = driver->read(1.0);
  EXPECT_EQ(reading.status, Reading::Status::kOk);
  EXPECT_EQ(reading.buttons, 6U);
}

TEST(Plugin, ThatCannotBeUsed_RefusedInOneLine) {
  const auto plugin = [](const std::string& name) { return settings(LAYFIGURE_TEST_PLUGINS "/" + name + ".so"); };
  expect_refusal(plugin("wrong_version"), "of version 99 of layfigure_device.h, expected 1");
  expect_refusal(plugin("no_symbol"), "it exports no layfigure_device_plugin()");
  expect_refusal(plugin("no_table"), "returned NULL");
  expect_refusal(plugin("no_read"), "its function read is NULL");
  expect_refusal(plugin("no_close"), "its function close is NULL");
  expect_refusal(plugin("does_not_open"), "the cable is not plugged in");
  expect_refusal(plugin("bad_info"), "max_force = nan");
  expect_refusal(plugin("no_name"), "has no name");
  const TemporaryFile text("text.so", "not a shared object");
  expect_refusal(settings(text.path()), "cannot be loaded as a plugin");
}

/// Each is unfit in one way, and the line that says so fails.
TEST(Plugin, Unfit_FailsTheConformanceTest) {
  const std::pair<const char*, const char*> cases[] = {
      {"nan_pose", "poses are finite"},
      {"not_unit", "quaternions are unit"},
      {"jumps", "nothing jumps"},
      {"far", "poses are within reach"},
      {"slow", "poses come often enough for forces"},
      {"never", "a pose comes"},
      {"blocks", "calls return at once"},
      {"takes_nan", "of a wrench that is not finite it exerts nothing"},
      {"unlimited", "of a wrench that is much too large it exerts what it can"},
      {"holds_on", "it lets go when told to"},
      {"weak", "it exerts the force asked for"},
      {"opens_once", "it opens again after close"},
      {"goes", "it stays there"},
  };
  for (const auto& [name, line] : cases) {
    const auto [passed, failed] = checked(settings(LAYFIGURE_TEST_PLUGINS "/" + std::string(name) + ".so"), 0.1);
    EXPECT_FALSE(passed) << name;
    EXPECT_NE(failed.find(line), std::string::npos) << name << ":\n" << failed;
  }
}

TEST(LcmFile, Good_SaysWhatTheDeviceIs) {
  messaging::Broker broker(0);
  EXPECT_EQ(open_driver(settings("lcm", {}, broker.url()))->info().name, "LCM device '0'");
  const TemporaryFile lengths("lengths.toml", "device_id = \"left\"\ngeometry = \"spidar-g6x4\"\nmax_force = 5\n");
  const auto driver = open_driver(settings("lcm", lengths.path(), broker.url()));
  EXPECT_EQ(driver->info().name, "LCM device 'left', SPIDAR-G6X4");
  EXPECT_EQ(driver->info().max_force, 5.0);
  EXPECT_GT(driver->info().max_torque, 0.0);
  EXPECT_FALSE(driver->info().simulated);
}

TEST(LcmFile, Bad_RefusedInOneLine) {
  const auto expect_bad = [](const std::string& text, const std::string& part) {
    const TemporaryFile file("bad.toml", text);
    expect_refusal(settings("lcm", file.path()), part);
  };
  expect_bad("device_id = 3", "device_id: expected a text");
  expect_bad("device_id = \"\"", "device_id: expected a text");
  expect_bad("max_force = -1", "max_force: expected a number, 0 or more");
  expect_bad("max_torque = nan", "max_torque");
  expect_bad("reach = 0", "reach: expected a number above 0");
  expect_bad("geometry = \"no-such.toml\"", "no such geometry file");
  expect_bad("speed = 1", "unknown key 'speed'");
  expect_bad("speed", "not TOML");
  expect_refusal(settings("lcm", "/no/such.toml"), "there is no such file");
  EXPECT_THROW((void)open_driver(settings("lcm", {}, "tcpq://127.0.0.1:1")), messaging::BusError);
}

}  // namespace
}  // namespace layfigure::device
