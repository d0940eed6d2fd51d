#include "layfigure/app/options.h"

#include <gtest/gtest.h>

#include <vector>

namespace layfigure::app {
namespace {

/// What a command line came to, with what it printed.
struct Outcome {
  ParsedOptions parsed;
  std::string out;
  std::string error;
};

Outcome parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "layfigure-server");
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  ParsedOptions parsed = parse_options(static_cast<int>(arguments.size()), arguments.data());
  return {std::move(parsed), ::testing::internal::GetCapturedStdout(), ::testing::internal::GetCapturedStderr()};
}

TEST(Options, CharacterOnly_HasTheDefaults) {
  const Outcome outcome = parse({"doll.glb"});
  ASSERT_TRUE(outcome.parsed.options) << outcome.error;
  const Options& options = *outcome.parsed.options;
  EXPECT_EQ(options.character, "doll.glb");
  EXPECT_EQ(options.server.simulation.clock, ClockKind::kRealtime);
  EXPECT_EQ(options.server.simulation.physics_hz, 1000.0);
  EXPECT_EQ(options.server.simulation.pose_hz, 60.0);
  EXPECT_FALSE(options.server.broker_port);
  EXPECT_FALSE(options.server.duration);
  EXPECT_NE(options.server.server_id, 0);
  EXPECT_EQ(outcome.error, "");
}

TEST(Options, AllGiven_AreTaken) {
  const Outcome outcome =
      parse({"doll.glb", "--doll", "soft.toml", "--broker", "7700", "--clock", "lockstep", "--physics-hz", "500",
             "--pose-hz", "24.5", "--channel-prefix", "left_", "--duration", "2.5", "--inspect", "--json"});
  ASSERT_TRUE(outcome.parsed.options) << outcome.error;
  const Options& options = *outcome.parsed.options;
  EXPECT_EQ(options.doll_settings, "soft.toml");
  EXPECT_EQ(options.server.broker_port, 7700);
  EXPECT_EQ(options.server.simulation.clock, ClockKind::kLockstep);
  EXPECT_EQ(options.server.simulation.physics_hz, 500.0);
  EXPECT_EQ(options.server.simulation.pose_hz, 24.5);
  EXPECT_EQ(options.server.channel_prefix, "left_");
  EXPECT_EQ(options.server.duration, 2.5);
  EXPECT_TRUE(options.inspect);
  EXPECT_TRUE(options.json);
}

TEST(Options, Devices_AreKeptInTheirOrderWithTheirConfigs) {
  const Outcome outcome = parse({"doll.glb", "--device", "spidar-g6", "--device", "my.so", "--device-config",
                                 "one.toml", "--device-config", "two.toml"});
  ASSERT_TRUE(outcome.parsed.options) << outcome.error;
  const ServerSettings& server = outcome.parsed.options->server;
  EXPECT_EQ(server.devices, (std::vector<std::string>{"spidar-g6", "my.so"}));
  EXPECT_EQ(server.device_configs, (std::vector<std::filesystem::path>{"one.toml", "two.toml"}));
}

TEST(Options, DeviceNone_IsNone) {
  const Outcome outcome = parse({"doll.glb", "--device", "none"});
  ASSERT_TRUE(outcome.parsed.options) << outcome.error;
  EXPECT_TRUE(outcome.parsed.options->server.devices.empty());
}

TEST(Options, WriteSettings_GoBesideTheCharacterOrIntoAFile) {
  const Outcome beside = parse({"--inspect", "a/doll.glb", "--write-settings"});
  ASSERT_TRUE(beside.parsed.options) << beside.error;
  EXPECT_EQ(beside.parsed.options->write_settings, "a/doll.doll.toml");
  EXPECT_FALSE(beside.parsed.options->force);
  const Outcome named = parse({"--inspect", "doll.glb", "--write-settings", "b.toml", "--force"});
  ASSERT_TRUE(named.parsed.options) << named.error;
  EXPECT_EQ(named.parsed.options->write_settings, "b.toml");
  EXPECT_TRUE(named.parsed.options->force);
  EXPECT_FALSE(parse({"--inspect", "doll.glb"}).parsed.options->write_settings);
}

TEST(Options, WriteSettingsBeforeTheCharacter_TakeItForNoFile) {
  const Outcome beside = parse({"--inspect", "--write-settings", "doll.glb"});
  ASSERT_TRUE(beside.parsed.options) << beside.error;
  EXPECT_EQ(beside.parsed.options->character, "doll.glb");
  EXPECT_EQ(beside.parsed.options->write_settings, "doll.doll.toml");
  const Outcome named = parse({"--inspect", "--write-settings", "b.toml", "doll.glb"});
  ASSERT_TRUE(named.parsed.options) << named.error;
  EXPECT_EQ(named.parsed.options->character, "doll.glb");
  EXPECT_EQ(named.parsed.options->write_settings, "b.toml");
}

TEST(Options, Geometry_IsOfJson) {
  const Outcome outcome = parse({"--inspect", "doll.glb", "--json", "--geometry"});
  ASSERT_TRUE(outcome.parsed.options) << outcome.error;
  EXPECT_TRUE(outcome.parsed.options->geometry);
}

TEST(Options, TwoRuns_HaveDifferentServerIds) {
  EXPECT_NE(parse({"a"}).parsed.options->server.server_id, parse({"a"}).parsed.options->server.server_id);
}

TEST(Options, Bad_RefusedInOneLineThatNamesOptionAndValue) {
  const std::vector<std::pair<std::vector<const char*>, std::vector<const char*>>> cases{
      {{}, {"CHARACTER"}},
      {{"a", "b"}, {"b"}},
      {{"a", "--device", "phantom"}, {"--device", "phantom"}},
      {{"a", "--device-config", "left.toml"}, {"--device-config", "--device"}},
      {{"a", "--device", "lcm", "--device", "lcm", "--device", "lcm", "--device-config", "1", "--device-config", "2"},
       {"--device-config", "2 files for 3 devices"}},
      {{"a", "--log", "x"}, {"--log"}},
      {{"a", "--clock", "fast"}, {"--clock", "fast", "lockstep"}},
      {{"a", "--physics-hz", "9"}, {"--physics-hz", "9", "20000"}},
      {{"a", "--physics-hz", "nan"}, {"--physics-hz", "nan"}},
      {{"a", "--physics-hz", "1e9"}, {"--physics-hz", "1e9"}},
      {{"a", "--physics-hz", "100x"}, {"--physics-hz", "100x"}},
      {{"a", "--physics-hz"}, {"--physics-hz"}},
      {{"a", "--pose-hz", "0"}, {"--pose-hz", "0"}},
      {{"a", "--pose-hz", "60", "--physics-hz", "50"}, {"--pose-hz", "60", "50"}},
      {{"a", "--broker", "65536"}, {"--broker", "65536", "65535"}},
      {{"a", "--broker", "-1"}, {"--broker", "-1"}},
      {{"a", "--broker", "ssh"}, {"--broker", "ssh"}},
      {{"a", "--broker", "0", "--lcm-url", "tcpq://127.0.0.1:7700"}, {"--broker", "--lcm-url"}},
      {{"a", "--lcm-url", "http://x"}, {"--lcm-url", "http://x"}},
      {{"a", "--channel-prefix", ".*"}, {"--channel-prefix", ".*"}},
      {{"a", "--duration", "-3"}, {"--duration", "-3"}},
      {{"a", "--json"}, {"--json", "--inspect"}},
      {{"a", "--inspect", "--geometry"}, {"--geometry", "--json"}},
      {{"a", "--write-settings"}, {"--write-settings", "--inspect"}},
      {{"a", "--inspect", "--force"}, {"--force", "--write-settings"}},
      {{"a", "--inspect", "--write-settings", "a.glb"}, {"a.glb", ".toml"}},
      {{"a", "--inspect", "--write-settings", "b.toml", "c.toml"}, {"c.toml"}},
  };
  for (const auto& [arguments, words] : cases) {
    const Outcome outcome = parse(arguments);
    EXPECT_FALSE(outcome.parsed.options) << words[0];
    EXPECT_EQ(outcome.parsed.exit_code, kExitUsage) << words[0];
    EXPECT_EQ(outcome.out, "") << words[0];
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    for (const char* word : words)
      EXPECT_NE(outcome.error.find(word), std::string::npos) << word << " in " << outcome.error;
  }
}

TEST(Options, HelpAndVersion_AreDoneWithoutACharacter) {
  const Outcome help = parse({"--help"});
  EXPECT_FALSE(help.parsed.options);
  EXPECT_EQ(help.parsed.exit_code, kExitDone);
  EXPECT_NE(help.out.find("Examples:"), std::string::npos);
  const Outcome version = parse({"--version"});
  EXPECT_EQ(version.parsed.exit_code, kExitDone);
  EXPECT_EQ(version.out.rfind("layfigure-server ", 0), 0U) << version.out;
}

}  // namespace
}  // namespace layfigure::app
