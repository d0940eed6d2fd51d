#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "layfigure/doll/settings.h"
#include "settings_file.h"

namespace layfigure::doll {
namespace {

using JointTables = test::SettingsFile;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST_F(JointTables, EveryKey_IsReadWithItsLine) {
  const DollSettings settings = load(R"([joints."*Arm"]
stiffness = 12
damping = 0.5
flow_damping = {factor = 2.0}
yield_torque = inf
hardening = 1.5
limits = {twist = [-30, 20], swing_y = [-10, 140], swing_z = [-5, 5]}
locked = ["twist", "bend_z"]
merge = false
shape = "capsule"
friction = 0.25
mass = 0.75
)");
  ASSERT_EQ(settings.joints.size(), 1U);
  const JointOverride& joint = settings.joints[0];
  EXPECT_EQ(joint.pattern, "*Arm");
  EXPECT_EQ(joint.line, 1);
  EXPECT_EQ(joint.stiffness->value.of(7.0), 12.0);
  EXPECT_EQ(joint.stiffness->line, 2);
  EXPECT_EQ(joint.damping->value.of(7.0), 0.5);
  EXPECT_EQ(joint.flow_damping->value.of(7.0), 14.0);
  EXPECT_EQ(joint.flow_damping->line, 4);
  EXPECT_EQ(joint.yield_torque->value.of(7.0), kInfinity);
  EXPECT_EQ(joint.hardening->value.of(7.0), 1.5);
  EXPECT_DOUBLE_EQ(joint.twist->value.lower, -30.0 * kDegree);
  EXPECT_DOUBLE_EQ(joint.twist->value.upper, 20.0 * kDegree);
  EXPECT_DOUBLE_EQ(joint.swing_y->value.upper, 140.0 * kDegree);
  EXPECT_DOUBLE_EQ(joint.swing_z->value.lower, -5.0 * kDegree);
  EXPECT_EQ(joint.swing_z->line, 7);
  EXPECT_EQ(joint.locked->value, (std::array<bool, 3>{true, false, true}));
  EXPECT_FALSE(joint.merge->value);
  EXPECT_EQ(joint.shape->value, ShapeKind::kCapsule);
  EXPECT_EQ(joint.friction->value, 0.25);
  EXPECT_EQ(joint.mass->value, 0.75);
  EXPECT_EQ(joint.mass->line, 12);
  EXPECT_FALSE(joint.density);
}

TEST_F(JointTables, Several_ComeInTheOrderOfTheFile) {
  const DollSettings settings = load("[joints.z]\nmerge = true\n[joints.\"a*\"]\n[joints.m]\n");
  ASSERT_EQ(settings.joints.size(), 3U);
  EXPECT_EQ(settings.joints[0].pattern, "z");
  EXPECT_EQ(settings.joints[1].pattern, "a*");
  EXPECT_EQ(settings.joints[2].pattern, "m");
}

TEST_F(JointTables, WrittenInOneLineOrWithDottedKeys_AreTheSame) {
  const DollSettings inline_tables = load("joints = {z = {friction = 1}, a = {limits = {twist = [-1, 1]}}}\n");
  ASSERT_EQ(inline_tables.joints.size(), 2U);
  EXPECT_EQ(inline_tables.joints[0].pattern, "z");
  const DollSettings dotted = load("[joints]\nz.friction = 1\na.limits.twist = [-1, 1]\n");
  ASSERT_EQ(dotted.joints.size(), 2U);
  EXPECT_EQ(dotted.joints[0].friction->value, 1.0);
  EXPECT_DOUBLE_EQ(dotted.joints[1].twist->value.upper, kDegree);
}

TEST_F(JointTables, ValuesOfSingleAxes_AreReadWithTheirLine) {
  const DollSettings settings = load(R"([joints.a]
stiffness = {twist = 3, bend_z = {factor = 0.5}}
damping = {bend_y = 0}
yield_torque = {twist = inf, bend_y = 1, bend_z = 2}
)");
  const JointOverride& joint = settings.joints[0];
  EXPECT_FALSE(joint.stiffness);
  EXPECT_EQ(joint.stiffness_axes->line, 2);
  EXPECT_EQ(joint.stiffness_axes->value[0]->of(7.0), 3.0);
  EXPECT_FALSE(joint.stiffness_axes->value[1]);
  EXPECT_EQ(joint.stiffness_axes->value[2]->of(7.0), 3.5);
  EXPECT_EQ(joint.damping_axes->value[1]->of(7.0), 0.0);
  EXPECT_EQ(joint.yield_torque_axes->value[0]->of(7.0), kInfinity);
  EXPECT_EQ(joint.yield_torque_axes->line, 4);
}

TEST_F(JointTables, SwingThatMayNotLeaveTheNeutralPose_MayByALittle) {
  const DollSettings settings =
      load("[joints.a]\nlimits = {twist = [0, 0], swing_y = [0, 140], swing_z = [-180, 180]}\n");
  const JointOverride& joint = settings.joints[0];
  EXPECT_EQ(joint.twist->value.lower, 0.0);
  EXPECT_EQ(joint.twist->value.upper, 0.0);
  EXPECT_DOUBLE_EQ(joint.swing_y->value.lower, -kLeastSwingDeg * kDegree);
  EXPECT_EQ(joint.swing_z->value.lower, -std::numbers::pi);
  EXPECT_EQ(joint.swing_z->value.upper, std::numbers::pi);
}

struct BadLine {
  std::string line;
  std::string words;
};

TEST_F(JointTables, BadValues_AreRefusedWithTableKeyAndWhatIsAllowed) {
  const std::vector<BadLine> lines{
      {"stiffness = -1", "stiffness = -1, expected [0, inf]"},
      {"stiffness = nan", "stiffness = nan, expected [0, inf]"},
      {"stiffness = \"12\"", "stiffness: expected a number or {factor = NUMBER}"},
      {"stiffness = true", "stiffness: expected a number or {factor = NUMBER}"},
      {"stiffness = {}", "stiffness: expected a number or {factor = NUMBER}"},
      {"stiffness = {times = 2}", "stiffness: expected a number or {factor = NUMBER}"},
      {"stiffness = {factor = 2, offset = 1}", "stiffness: expected a number or {factor = NUMBER}"},
      {"stiffness = {factor = \"2\"}", "stiffness.factor: expected a number"},
      {"stiffness = {factor = 0}", "stiffness.factor = 0, expected (0, 1e+06]"},
      {"stiffness = {twist = -1}", "stiffness.twist = -1, expected [0, inf]"},
      {"stiffness = {twist = \"1\"}", "stiffness.twist: expected a number or {factor = NUMBER}"},
      {"stiffness = {twist = {twist = 1}}", "stiffness.twist: expected a number or {factor = NUMBER}"},
      {"stiffness = {twist = {factor = 0}}", "stiffness.twist.factor = 0, expected (0, 1e+06]"},
      {"stiffness = {twist = 1, bend = 2}", "stiffness: unknown axis 'bend', expected one of twist, bend_y, bend_z"},
      {"stiffness = {twist = 1, factor = 2}", "stiffness: unknown axis 'factor', expected one of twist"},
      {"damping = {bend_y = inf}", "damping.bend_y = inf, expected [0, 1e+18]"},
      {"yield_torque = {bend_z = 0}", "yield_torque.bend_z = 0, expected (0, inf]"},
      {"flow_damping = {twist = 1}", "flow_damping: expected a number or {factor = NUMBER}"},
      {"hardening = {twist = 1}", "hardening: expected a number or {factor = NUMBER}"},
      {"damping = inf", "damping = inf, expected [0, 1e+18]"},
      {"flow_damping = -0.5", "flow_damping = -0.5, expected"},
      {"yield_torque = nan", "yield_torque = nan, expected [0, inf]"},
      {"hardening = -1", "hardening = -1, expected"},
      {"friction = -0.1", "friction = -0.1, expected [0, 1e+06]"},
      {"friction = [1]", "friction: expected a number"},
      {"density = 0", "density = 0, expected (0, 1e+06]"},
      {"mass = -2", "mass = -2, expected (0, 1e+06]"},
      {"mass = {factor = 2}", "mass: expected a number"},
      {"merge = 1", "merge: expected true or false"},
      {"shape = \"cube\"", "shape: expected one of hull, capsule, none"},
      {"shape = 3", "shape: expected one of hull, capsule, none"},
      {"locked = \"twist\"", "locked: expected a list of twist, bend_y, bend_z"},
      {"locked = [1]", "locked: expected a list of twist, bend_y, bend_z"},
      {"locked = [\"roll\"]", "locked: unknown axis 'roll', expected a list of twist, bend_y, bend_z"},
      {"limits = 30", "limits: expected a table"},
      {"limits = {}", "limits: expected a table"},
      {"limits = {roll = [-1, 1]}", "limits: unknown axis 'roll', expected one of twist, swing_y, swing_z"},
      {"limits = {twist = 30}", "limits.twist: expected [lower, upper]"},
      {"limits = {twist = [-30]}", "limits.twist: expected [lower, upper]"},
      {"limits = {twist = [-30, 0, 30]}", "limits.twist: expected [lower, upper]"},
      {"limits = {twist = [\"a\", 30]}", "limits.twist lower: expected a number"},
      {"limits = {twist = [-30, nan]}", "limits.twist upper = nan, expected [-180, 180]"},
      {"limits = {twist = [-270, 30]}", "limits.twist lower = -270, expected [-180, 180]"},
      {"limits = {twist = [30, -30]}", "limits.twist: the lower bound is above the upper one"},
      {"limits = {swing_y = [10, 140]}", "limits.swing_y: the neutral pose, 0, is outside"},
      {"limits = {swing_z = [-140, -10]}", "limits.swing_z: the neutral pose, 0, is outside"},
      {"stifness = 1", "unknown key 'stifness', expected one of stiffness, damping"},
  };
  for (const BadLine& bad : lines) {
    const std::string what = complaint("density = 250\n[joints.\"left*\"]\n" + bad.line + "\n");
    EXPECT_NE(what.find(":3: [joints.\"left*\"] " + bad.words), std::string::npos) << what;
  }
}

TEST_F(JointTables, NamesWithControlCharacters_StayInOneLine) {
  EXPECT_NE(complaint("[joints.\"a\\nb\"]\nfriction = -1\n").find("[joints.\"a\\u000Ab\"] friction"),
            std::string::npos);
  EXPECT_NE(complaint("[joints.a]\n\"x\\ny\" = 1\n").find("unknown key 'x?y'"), std::string::npos);
  EXPECT_NE(complaint("\"x\\ny\" = 1\n").find("unknown key 'x?y'"), std::string::npos);
}

TEST_F(JointTables, DensityBesideMass_IsRefused) {
  EXPECT_NE(complaint("[joints.a]\ndensity = 1\nmass = 1\n").find("expected only one of them"), std::string::npos);
}

TEST_F(JointTables, NotTables_AreRefused) {
  EXPECT_NE(complaint("joints = 3\n").find(":1: joints: expected tables"), std::string::npos);
  EXPECT_NE(complaint("[[joints]]\nstiffness = 1\n").find("joints: expected tables"), std::string::npos);
  EXPECT_NE(complaint("[joints]\narm = 3\n").find(":2: [joints.\"arm\"] expected a table"), std::string::npos);
}

TEST_F(JointTables, Twice_IsRefusedWithTheLine) {
  const std::string table = complaint("[joints.a]\nfriction = 1\n[joints.a]\nfriction = 2\n");
  EXPECT_NE(table.find(":3: not TOML"), std::string::npos) << table;
  const std::string key = complaint("[joints.a]\nfriction = 1\nfriction = 2\n");
  EXPECT_NE(key.find(":3: not TOML"), std::string::npos) << key;
}

}  // namespace
}  // namespace layfigure::doll
