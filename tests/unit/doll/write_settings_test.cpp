#include "layfigure/doll/write_settings.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <sstream>

#include "angles.h"
#include "axis_values.h"
#include "layfigure/doll/build.h"
#include "person_fixture.h"
#include "rig_fixture.h"
#include "settings_file.h"
#include "toml_text.h"

namespace layfigure::doll {
namespace {

void expect_same_law(const dynamics::JointLaw& a, const dynamics::JointLaw& b) {
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.damping, b.damping);
  EXPECT_EQ(a.flow_damping, b.flow_damping);
  EXPECT_EQ(a.yield_torque, b.yield_torque);
  EXPECT_EQ(a.hardening, b.hardening);
  EXPECT_EQ(a.shape.axes.coeffs(), b.shape.axes.coeffs());
  EXPECT_EQ(a.shape.stiffness, b.shape.stiffness);
  EXPECT_EQ(a.shape.damping, b.shape.damping);
  EXPECT_EQ(a.shape.yield, b.shape.yield);
  EXPECT_EQ(a.shape.locked, b.shape.locked);
}

void expect_same_limits(const dynamics::JointLimits& a, const dynamics::JointLimits& b) {
  EXPECT_EQ(a.axes.coeffs(), b.axes.coeffs());
  EXPECT_EQ(a.reference.coeffs(), b.reference.coeffs());
  EXPECT_EQ(a.twist_lower, b.twist_lower);
  EXPECT_EQ(a.twist_upper, b.twist_upper);
  EXPECT_EQ(a.swing_lower, b.swing_lower);
  EXPECT_EQ(a.swing_upper, b.swing_upper);
}

/// Bit for bit.
void expect_same(const Doll& a, const Doll& b) {
  ASSERT_EQ(a.definition.bodies.size(), b.definition.bodies.size());
  for (std::size_t i = 0; i < a.definition.bodies.size(); ++i) {
    const dynamics::BodyDefinition& p = a.definition.bodies[i];
    const dynamics::BodyDefinition& q = b.definition.bodies[i];
    SCOPED_TRACE(p.name);
    EXPECT_EQ(p.name, q.name);
    EXPECT_EQ(p.parent, q.parent);
    EXPECT_EQ(p.anchor, q.anchor);
    EXPECT_EQ(p.rotation.coeffs(), q.rotation.coeffs());
    EXPECT_EQ(p.rest_rotation.coeffs(), q.rest_rotation.coeffs());
    EXPECT_EQ(p.mass, q.mass);
    EXPECT_EQ(p.com, q.com);
    EXPECT_EQ(p.inertia, q.inertia);
    expect_same_law(p.joint, q.joint);
    expect_same_limits(p.limits, q.limits);
    EXPECT_EQ(a.matter[i].density, b.matter[i].density);
    EXPECT_EQ(a.matter[i].shape, b.matter[i].shape);
    EXPECT_EQ(a.matter[i].friction, b.matter[i].friction);
  }
  EXPECT_EQ(a.root_pin.stiffness, b.root_pin.stiffness);
  EXPECT_EQ(a.root_pin.damping, b.root_pin.damping);
  EXPECT_EQ(a.root_pin.angular_stiffness, b.root_pin.angular_stiffness);
  EXPECT_EQ(a.root_pin.angular_damping, b.root_pin.angular_damping);
  EXPECT_EQ(a.body_of_bone, b.body_of_bone);
}

class WrittenSettings : public test::SettingsFile {
 protected:
  [[nodiscard]] std::string written() const {
    std::ostringstream text;
    text << std::ifstream(path_).rdbuf();
    return text.str();
  }

  void expect_to_read_back(const character::Rig& rig, const DollSettings& settings) {
    const Doll doll = build_doll(rig, settings);
    SCOPED_TRACE(settings_text(doll));
    write_settings(doll, path_, true);
    expect_same(doll, build_doll(rig, load_settings(path_)));
  }
};

TEST_F(WrittenSettings, OfDefaults_MakeTheSameDoll) { expect_to_read_back(test::make_adult(), {}); }

TEST_F(WrittenSettings, OfAnatomicalLimits_MakeTheSameDoll) {
  expect_to_read_back(test::make_person({.arm_slope = 0.4, .roll = 0.7}), settings_of(*find_material("wood")));
}

TEST_F(WrittenSettings, OfARigWithOddNumbers_MakeTheSameDoll) {
  character::Rig rig = test::moved(test::make_adult(), test::odd_motion());
  character::Bone tip;
  tip.name = "tip";
  tip.parent = 4;
  rig.bones.push_back(tip);
  DollSettings settings;
  settings.density = 1.0 / 3.0;
  settings.largest_sag = 0.1;
  expect_to_read_back(rig, settings);
}

TEST_F(WrittenSettings, OfSettingsOfEveryKind_MakeTheSameDoll) {
  const DollSettings settings = load(R"(density = 333.3
total_mass = 11.7
[joints."*"]
damping = {factor = 1.1}
friction = 0.7
[joints."left*"]
limits = {twist = [-33.3, 21.7], swing_y = [-10, 140.1], swing_z = [-180, 7]}
locked = ["bend_y"]
[joints.left2]
mass = 0.7
shape = "capsule"
[joints.right1]
yield_torque = inf
stiffness = inf
hardening = 0.1
[joints.right2]
density = 123.4
stiffness = {twist = 3.3, bend_z = {factor = 7.1}}
damping = {bend_y = 0}
yield_torque = {twist = inf, bend_y = 0.7}
)");
  expect_to_read_back(test::make_adult(), settings);
}

TEST_F(WrittenSettings, OfAxesThatDiffer_GiveEach) {
  const std::string stiff = "elastic_modulus = 1e12\nyield_stress = 1e9\n";  // nothing is raised, which makes round
  const DollSettings settings = load(stiff);
  expect_to_read_back(test::make_flat_adult(), settings);
  const std::string text = settings_text(build_doll(test::make_flat_adult(), settings));
  EXPECT_NE(text.find("\nstiffness = {twist = "), std::string::npos) << text;
  EXPECT_NE(text.find("\nyield_torque = {twist = "), std::string::npos) << text;
  expect_to_read_back(test::make_flat_adult(), load(stiff + "[joints.left1]\nstiffness = 1.7\n"));
}

TEST(AxisValues, OfRandomLaws_AreExactOrNone) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> value(0.1, 10.0);
  for (int k = 0; k < 10'000; ++k) {
    double unit = 0.0;
    Eigen::Vector3d ratios;
    set_axis_values({value(random), value(random), value(random)}, unit, ratios);
    const auto values = exact_axis_values(unit, ratios);
    ASSERT_TRUE(values.has_value()) << unit << " " << ratios.transpose();
    double unit_again = 0.0;
    Eigen::Vector3d ratios_again;
    set_axis_values(*values, unit_again, ratios_again);
    EXPECT_EQ(unit_again, unit);
    EXPECT_EQ(ratios_again, ratios);
  }
}

TEST(AxisValues, OfLooseAndRigidLaws_AreNone) {
  EXPECT_FALSE(exact_axis_values(0.0, Eigen::Vector3d(1, 2, 1)).has_value());
  EXPECT_FALSE(exact_axis_values(std::numeric_limits<double>::infinity(), Eigen::Vector3d(1, 2, 1)).has_value());
}

TEST_F(WrittenSettings, OfNamesThatNeedQuotes_MakeTheSameDoll) {
  character::Rig rig = test::make_adult();
  rig.bones[1].name = "say \"x\"\\\n\x7f";
  rig.bones[2].name = "m:左 arm.001";
  rig.bones[3].name = "a*?";
  rig.bones[4].name = "caf\xe9";  // Latin 1
  rig.bones[5].name = "= # [x]";
  rig.name = "two\nlines\xff";
  expect_to_read_back(rig, {});
}

TEST_F(WrittenSettings, Comments_SayWhyEachValueIs) {
  const Doll doll = build_doll(test::make_adult(), load("density = 200\n[joints.left1]\nstiffness = 9\n"));
  const std::string text = settings_text(doll);
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line)) {
    const bool is_value = line.find(" = ") != std::string::npos;
    EXPECT_TRUE(!is_value || line.find("# ") != std::string::npos) << line;
  }
  EXPECT_NE(text.find("density = 200.0"), std::string::npos);
  EXPECT_NE(text.find("# line 1 of the settings\n"), std::string::npos) << text;
  EXPECT_NE(text.find("# N m/rad, line 3 of the settings\n"), std::string::npos);
  EXPECT_NE(text.find("# N m, raised to hold the limb's weight\n"), std::string::npos);
  EXPECT_NE(text.find("# material soft vinyl\n"), std::string::npos);
  EXPECT_NE(text.find("# own skin\n"), std::string::npos);
  EXPECT_NE(text.find("limits.twist = [-90.0, 90.0]"), std::string::npos);
}

TEST_F(WrittenSettings, FileThatIsThere_IsKeptUnlessItMayBeReplaced) {
  const Doll doll = build_doll(test::make_adult());
  std::ofstream(path_) << "# mine\n";
  const std::string what = complaint_of([&] { write_settings(doll, path_, false); });
  EXPECT_NE(what.find("there is such a file already; --force replaces it"), std::string::npos) << what;
  EXPECT_EQ(written(), "# mine\n");
  write_settings(doll, path_, true);
  EXPECT_EQ(written(), settings_text(doll));
}

TEST_F(WrittenSettings, DanglingLink_IsKept) {
  const std::filesystem::path target = path_.string() + ".target";
  std::filesystem::create_symlink(target, path_);
  const std::string what = complaint_of([&] { write_settings(build_doll(test::make_adult()), path_, false); });
  EXPECT_NE(what.find("there is such a file already"), std::string::npos) << what;
  EXPECT_FALSE(std::filesystem::exists(target));
}

TEST_F(WrittenSettings, Folder_IsRefused) {
  std::filesystem::create_directory(path_);
  const std::string what = complaint_of([&] { write_settings(build_doll(test::make_adult()), path_, true); });
  EXPECT_NE(what.find("a folder, expected a file to write"), std::string::npos) << what;
}

TEST_F(WrittenSettings, FolderThatIsNotThere_IsRefused) {
  const std::filesystem::path inside = path_ / "doll.toml";
  const std::string what = complaint_of([&] { write_settings(build_doll(test::make_adult()), inside, false); });
  EXPECT_NE(what.find("cannot be written"), std::string::npos) << what;
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST(TomlNumber, Any_ReadsBackExactly) {
  EXPECT_EQ(toml_number(250.0), "250.0");
  EXPECT_EQ(toml_number(0.1), "0.1");
  EXPECT_EQ(toml_number(1e300), "1e+300");
  EXPECT_EQ(toml_number(-0.0), "-0.0");
  EXPECT_EQ(toml_number(std::numeric_limits<double>::infinity()), "inf");
  for (const double value : {1.0 / 3.0, 5e-324, 1.7976931348623157e308, 123456789.123456789}) {
    EXPECT_EQ(std::strtod(toml_number(value).c_str(), nullptr), value);
  }
}

TEST(TomlKey, CharactersThatEndIt_AreEscaped) {
  EXPECT_EQ(toml_key("a\"b\\c"), "\"a\\\"b\\\\c\"");
  EXPECT_EQ(toml_key("a\nb\x7f"), "\"a\\u000Ab\\u007F\"");
  EXPECT_EQ(toml_key("腕"), "\"腕\"");
}

TEST(TomlKey, BytesThatAreNotUtf8_StandAsQuestionMarks) {
  EXPECT_EQ(toml_key("\xe9"), "\"?\"");
  EXPECT_EQ(toml_key("\xc0\xaf"), "\"?\"");          // overlong
  EXPECT_EQ(toml_key("\xed\xa0\x80x"), "\"?x\"");    // half of a surrogate pair
  EXPECT_EQ(toml_key("\xf4\x90\x80\x80"), "\"?\"");  // above the last character
  EXPECT_EQ(toml_key("\xe8\x85"), "\"?\"");          // cut off
  EXPECT_EQ(toml_comment("a\nb\xff"), "a?b?");
}

TEST(Degrees, OfRadiansMadeOfDegrees_AreExact) {
  for (int k = -1800; k <= 1800; ++k) {
    const double radians = to_radians(0.1 * k);
    const auto degrees = exact_degrees(radians);
    ASSERT_TRUE(degrees) << k;
    EXPECT_EQ(to_radians(*degrees), radians) << k;
  }
  EXPECT_EQ(exact_degrees(-std::numeric_limits<double>::infinity()), -180.0);
}

}  // namespace
}  // namespace layfigure::doll
