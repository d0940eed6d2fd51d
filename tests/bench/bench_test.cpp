// layfigure-bench as its users call it.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "scene.h"

namespace layfigure::testing {
namespace {

struct Outcome {
  int exit_code;
  std::string output;  ///< stdout and stderr
};

Outcome run(const std::string& program, const std::string& arguments) {
  FILE* pipe = popen(("\"" + program + "\" " + arguments + " 2>&1").c_str(), "r");
  Outcome outcome{-1, ""};
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) outcome.output += buffer.data();
  outcome.exit_code = WEXITSTATUS(pclose(pipe));
  return outcome;
}

Outcome bench(const std::string& arguments) { return run(LAYFIGURE_BENCH, arguments); }
Outcome bullet_peer(const std::string& arguments) { return run(LAYFIGURE_BULLET_PEER, arguments); }

const std::string kDollFile = std::string(LAYFIGURE_TEST_DATA) + "/scenes/doll-52.json";
// Quoted for the shell: the folder may have spaces in its name.
const std::string kDoll = "\"" + kDollFile + "\"";

TEST(Bench, WorkPrecisionJson_HasTheStatedFields) {
  const Outcome outcome = bench("work-precision --scene " + kDoll + " --order 4 --h 0.04,0.02 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const auto list = nlohmann::json::parse(outcome.output);
  ASSERT_EQ(list.size(), 2);
  EXPECT_EQ(list[0].at("scene"), "doll-52");
  EXPECT_EQ(list[0].at("order"), 4);
  EXPECT_EQ(list[0].at("h"), 0.04);
  EXPECT_EQ(list[0].at("steps"), 25);
  EXPECT_GT(list[0].at("cpu_s"), 0.0);
  EXPECT_GT(list[0].at("us_per_step"), 0.0);
  EXPECT_TRUE(list[0].at("energy").is_number());
  EXPECT_EQ(list[0].at("finite"), true);
  const Scene scene = load_scene(kDollFile);
  const auto expected = run_scene(scene, dynamics::Model(scene.definition), 25, 4).coms;
  ASSERT_EQ(list[0].at("com").size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_EQ(list[0]["com"][i][k], expected[i][k]);
  }
  ASSERT_EQ(list[0].at("rest").size(), expected.size());
  EXPECT_EQ(list[0]["rest"][0], (std::vector<double>{1.0, 0.0, 0.0, 0.0})) << "nothing flowed";
}

TEST(BulletPeer, Json_HasTheSameFields) {
  const std::string scene = std::string(LAYFIGURE_TEST_DATA) + "/scenes/chain-20.json";
  const Outcome outcome = bullet_peer("--scene \"" + scene + "\" --h 0.0005,0.00025");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const auto list = nlohmann::json::parse(outcome.output);
  ASSERT_EQ(list.size(), 2);
  EXPECT_EQ(list[0].at("scene"), "chain-20");
  EXPECT_EQ(list[0].at("engine"), "Bullet btMultiBody");
  EXPECT_EQ(list[0].at("steps"), 2000);
  EXPECT_GT(list[0].at("cpu_s"), 0.0);
  EXPECT_EQ(list[0].at("com").size(), 20);
  EXPECT_EQ(list[0].at("finite"), true);
}

/// Writes the stored chain of 20 as a free one with a ball at its beginning, a little over a floor.
std::string chain_on_a_floor() {
  std::ifstream stored(std::string(LAYFIGURE_TEST_DATA) + "/scenes/chain-20.json");
  auto scene = nlohmann::json::parse(stored);
  scene["root"] = "free";
  scene["floor"] = 0.5;
  scene["duration"] = 0.1;
  scene["bodies"][0]["anchor"] = {0.0, 0.0, 0.021};
  scene["limbs"] = {{{"body", 0}, {"from", {0.0, 0.0, 0.0}}, {"to", {0.0, 0.0, 0.0}}, {"radius", 0.02}}};
  const std::string path = ::testing::TempDir() + "chain-on-a-floor.json";
  std::ofstream(path) << scene;
  return "\"" + path + "\"";
}

TEST(Bench, SceneWithAFloor_TellsHowItIsKeptInEveryEngine) {
  const std::string scene = chain_on_a_floor();
  for (const Outcome& outcome :
       {bench("work-precision --json --scene " + scene + " --h 0.001"), bullet_peer("--scene " + scene + " --h 0.0001"),
        bullet_peer("--dantzig --scene " + scene + " --h 0.0001")}) {
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    const auto touch = nlohmann::json::parse(outcome.output)[0].at("touch");
    EXPECT_LE(touch.at("penetration"), 2e-3);
    EXPECT_GT(touch.at("kinetic"), 0.0);
    EXPECT_GT(touch.at("support"), 0.1) << "the ball has met the floor";
  }
}

TEST(BulletPeer, MissingScene_SaysSoAndExits1) {
  const Outcome outcome = bullet_peer("--scene nowhere.json --h 0.01");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.output, "bullet_peer: nowhere.json: cannot be read\n");
}

/// The figures that a subject prints, by name.
std::map<std::string, nlohmann::json> figures(const std::string& arguments) {
  const Outcome outcome = bench(arguments + " --json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  std::map<std::string, nlohmann::json> figures;
  for (const auto& figure : nlohmann::json::parse(outcome.output)) {
    const std::string name = figure.at("name");
    EXPECT_TRUE(figure.at("value").is_number()) << name;
    EXPECT_TRUE(figure.at("unit").is_string()) << name;
    EXPECT_TRUE(figure.at("holds").is_boolean()) << name;
    EXPECT_TRUE(figure.at("target").is_null() || figure["target"].is_number()) << name;
    EXPECT_EQ(figure["holds"], figure["target"].is_null() || figure["value"] <= figure["target"]) << name;
    figures[name] = figure;
  }
  return figures;
}

TEST(Bench, CostJson_HasEveryOrder) {
  const auto costs = figures("cost --scene \"" + std::string(LAYFIGURE_TEST_DATA) + "/scenes/chain-20.json\"");
  for (const char* order : {"1", "2", "3", "4"}) {
    const std::string name = std::string("chain-20 order ") + order;
    EXPECT_GT(costs.at(name + " step").at("value"), costs.at(name + " per joint and solve").at("value"));
    EXPECT_LE(costs.at(name + " step, least of the runs").at("value"), costs.at(name + " step").at("value"));
    if (name.back() == '1') continue;
    EXPECT_GT(costs.at(name + ", wall time: two threads / one").at("value"), 0.0);
  }
}

TEST(Bench, ContactJson_ProblemsAreSolvedColdAndWarmBesideBullet) {
  const auto contacts = figures("contact --rows 12");
  for (const char* start : {"cold", "warm"}) {
    const std::string name = std::string("stack of 1, friction, 12 rows, ") + start;
    EXPECT_GT(contacts.at(name).at("value"), 0.0);
    EXPECT_EQ(contacts.at(name + ": residual").at("target"), 1e-10);
    EXPECT_EQ(contacts.at(name + ": residual").at("holds"), true);
  }
  EXPECT_GE(contacts.at("stack of 1, friction, 12 rows, cold: iterations").at("value"), 1);
  EXPECT_EQ(contacts.at("stack of 1, friction, 12 rows, warm: iterations").at("value"), 0);
  EXPECT_LE(contacts.at("ball, frictionless, 1 row, Bullet Dantzig: residual").at("value"), 1e-5);
  EXPECT_GT(contacts.at("ball, base step: with contacts / without").at("value"), 1.0);
}

TEST(Bench, SkipJson_TellsWhatEachSkippedPartSaves) {
  const auto savings = figures("skip");
  for (const char* pose : {"one finger posed", "one hand posed"}) {
    const auto& ratio = savings.at(std::string(pose) + ", step: rest asleep / all awake");
    EXPECT_EQ(ratio.at("target"), 0.25);
    EXPECT_GT(ratio.at("value"), 0.0);
    EXPECT_GT(savings.at(std::string(pose) + ", step: rest asleep").at("value"), 0.0);
    EXPECT_GE(savings.at(std::string(pose) + ": bodies asleep, mean").at("value"), 8) << "the legs at least";
  }
  for (const char* ratio :
       {"doll at rest, step: at rest / all awake", "doll in motion, step: with sleep / without",
        "chain of 8, 3 joints, step: welded / stiff", "joints far from their limits, step: with limits / without",
        "shapes far apart, step: with shapes / without"}) {
    EXPECT_GT(savings.at(ratio).at("value"), 0.0) << ratio;
    EXPECT_TRUE(savings.at(ratio).at("target").is_null()) << ratio;
  }
  EXPECT_EQ(savings.at("doll at rest, step").at("unit"), "us");
  EXPECT_EQ(savings.at("doll in motion: bodies asleep, mean").at("value"), 0.0) << "nothing to skip";
  EXPECT_EQ(savings.at("joints far from their limits: rows, most").at("value"), 0.0);
  EXPECT_EQ(savings.at("shapes far apart: rows, most").at("value"), 0.0);
}

TEST(Bench, StressJson_SharesAreShares) {
  const auto shares = figures("stress --scenes 30");
  EXPECT_EQ(shares.at("random scenes").at("value"), 30);
  EXPECT_EQ(shares.at("scenes that failed").at("holds"), true);
  EXPECT_GT(shares.at("share of steps made again in shorter parts").at("value"), 0.0);
  EXPECT_LT(shares.at("share of steps made again in shorter parts").at("value"), 1.0);
}

TEST(Bench, FiguresTable_HasALineForEach) {
  const Outcome outcome = bench("stress --scenes 3");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 10) << outcome.output;
  EXPECT_NE(outcome.output.find("scenes that failed"), std::string::npos);
}

TEST(Bench, StepThatDoesNotDivideTheDuration_EndsOnTime) {
  const Outcome outcome = bench("work-precision --scene " + kDoll + " --h 0.0333 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(nlohmann::json::parse(outcome.output)[0].at("steps"), 30);
}

TEST(Bench, MissingScene_SaysSoAndExits1) {
  const Outcome outcome = bench("work-precision --scene nowhere.json --h 0.01");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.output, "layfigure-bench: nowhere.json: cannot be read\n");
}

TEST(Bench, BadUsage_Exits2) {
  EXPECT_EQ(bench("").exit_code, 2);
  EXPECT_EQ(bench("nothing").exit_code, 2);
  EXPECT_EQ(bench("work-precision --h 0.01").exit_code, 2);
  EXPECT_EQ(bench("work-precision --scene " + kDoll + " --order 7 --h 0.01").exit_code, 2);
  EXPECT_EQ(bench("work-precision --scene " + kDoll + " --h 0").exit_code, 2);
  EXPECT_EQ(bench("contact --rows 0").exit_code, 2);
  EXPECT_EQ(bench("stress --scenes 0").exit_code, 2);
  EXPECT_EQ(bench("--help").exit_code, 0);
}

}  // namespace
}  // namespace layfigure::testing
