// layfigure-bench haptics as its users call it.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace layfigure::testing {
namespace {

struct Outcome {
  int exit_code;
  std::string output;  ///< stdout and stderr
};

Outcome bench(const std::string& arguments) {
  FILE* pipe = popen(("\"" LAYFIGURE_BENCH "\" " + arguments + " 2>&1").c_str(), "r");
  Outcome outcome{-1, ""};
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) outcome.output += buffer.data();
  outcome.exit_code = WEXITSTATUS(pclose(pipe));
  return outcome;
}

/// What depends on the machine's speed.
bool is_time(const nlohmann::json& figure) { return figure.at("unit") == "us" || figure.at("unit") == "kHz"; }

TEST(HapticsBench, QuickRun_HoldsEveryTargetThatIsNoTime) {
  const std::string map = ::testing::TempDir() + "z-width.json";
  const Outcome outcome = bench("haptics --quick --json --z-width \"" + map + "\"");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  int judged = 0;
  for (const auto& figure : nlohmann::json::parse(outcome.output)) {
    ASSERT_TRUE(figure.at("value").is_number()) << figure;
    if (figure.at("target").is_null() || is_time(figure)) continue;
    EXPECT_TRUE(figure.at("holds").get<bool>()) << figure;
    ++judged;
  }
  EXPECT_GE(judged, 26);
  std::ifstream file(map);
  const auto walls = nlohmann::json::parse(file);
  ASSERT_EQ(walls.size(), 6) << "three rates, with and without a hand";
  for (const auto& wall : walls) EXPECT_GT(wall.at("stiffness"), 0.0) << wall;
}

TEST(HapticsBench, MapThatCannotBeWritten_SaysSoAndExits1) {
  const Outcome outcome = bench("haptics --quick --z-width /nowhere/map.json");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.output, "layfigure-bench: /nowhere/map.json: cannot be written\n");
}

}  // namespace
}  // namespace layfigure::testing
