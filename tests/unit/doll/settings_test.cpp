#include "layfigure/doll/settings.h"

#include <gtest/gtest.h>

#include <limits>

#include "settings_file.h"

namespace layfigure::doll {
namespace {

using SettingsFile = test::SettingsFile;

TEST_F(SettingsFile, Empty_IsTheDefaults) {
  EXPECT_EQ(load("").density, DollSettings{}.density);
  EXPECT_EQ(load("# nothing\n").yield_stress, DollSettings{}.yield_stress);
}

TEST_F(SettingsFile, EveryField_IsRead) {
  const DollSettings s = load(
      "density = 500\nelastic_modulus = 2e6\npoisson_ratio = 0.25\nhardening = 6.0\nviscosity = 3.0\nflow_viscosity = "
      "4.0\nyield_stress = 5.0\n"
      "largest_sag = 0.06\nlargest_strain = 0.3\nhold_margin = 7.0\ndamping_ratio = 0.8\nlargest_flow_rate = 9.0\n");
  EXPECT_EQ(s.density, 500.0);
  EXPECT_EQ(s.elastic_modulus, 2e6);
  EXPECT_EQ(s.poisson_ratio, 0.25);
  EXPECT_EQ(s.hardening, 6.0);
  EXPECT_EQ(s.viscosity, 3.0);
  EXPECT_EQ(s.flow_viscosity, 4.0);
  EXPECT_EQ(s.yield_stress, 5.0);
  EXPECT_EQ(s.largest_sag, 0.06);
  EXPECT_EQ(s.largest_strain, 0.3);
  EXPECT_EQ(s.hold_margin, 7.0);
  EXPECT_EQ(s.damping_ratio, 0.8);
  EXPECT_EQ(s.largest_flow_rate, 9.0);
}

TEST_F(SettingsFile, Material_IsTheBaseOfWhatIsNotGiven) {
  const Material& clay = *find_material("clay");
  const DollSettings s = load("density = 500\nmaterial = \"clay\"\nhold_margin = 3.0\n");  // the order is no matter
  EXPECT_EQ(s.material, "clay");
  EXPECT_EQ(s.density, 500.0);
  EXPECT_EQ(s.hold_margin, 3.0);
  EXPECT_EQ(s.elastic_modulus, clay.elastic_modulus);
  EXPECT_EQ(s.poisson_ratio, clay.poisson_ratio);
  EXPECT_EQ(s.viscosity, clay.viscosity);
  EXPECT_EQ(s.flow_viscosity, clay.flow_viscosity);
  EXPECT_EQ(s.yield_stress, clay.yield_stress);
  EXPECT_EQ(s.hardening, clay.hardening);
  EXPECT_EQ(load("material = \"soft vinyl\"").density, DollSettings{}.density);
}

TEST_F(SettingsFile, UnknownMaterial_IsRefusedWithTheKnownOnes) {
  const std::string what = complaint("density = 500\nmaterial = \"wod\"\n");
  EXPECT_NE(what.find(":2: material = \"wod\", expected one of \"soft vinyl\", \"wood\""), std::string::npos) << what;
  for (const std::string value : {"3", "true", "[\"wood\"]", "{name = \"wood\"}"}) {
    EXPECT_NE(complaint("material = " + value + "\n").find(":1: material: expected a name in quotes"),
              std::string::npos)
        << value;
  }
}

TEST_F(SettingsFile, UnknownKey_IsRefusedWithItsLine) {
  const std::string what = complaint("density = 500\ndensty = 400\n");
  EXPECT_NE(what.find(":2: unknown key 'densty'"), std::string::npos) << what;
}

TEST_F(SettingsFile, NotANumber_IsRefused) {
  for (const std::string value : {"\"heavy\"", "true", "[1]", "{a = 1}", "2026-11-22"}) {
    EXPECT_NE(complaint("density = " + value + "\n").find(":1: density: expected a number"), std::string::npos)
        << value;
  }
}

TEST_F(SettingsFile, OutOfRange_IsRefusedWithTheRange) {
  for (const std::string line :
       {"density = 0", "density = -1", "density = nan", "density = inf", "elastic_modulus = -1", "hold_margin = 0.5",
        "largest_sag = 0", "largest_sag = 2", "damping_ratio = 11", "poisson_ratio = -1", "poisson_ratio = 0.6",
        "hardening = -1", "largest_flow_rate = 0", "yield_stress = 1e300"}) {
    EXPECT_NE(complaint(line + "\n").find("expected "), std::string::npos) << line;
  }
  EXPECT_NE(complaint("density = -1").find("density = -1, expected (0, 1e+06]"), std::string::npos);
}

TEST_F(SettingsFile, NotToml_IsRefusedWithItsLine) {
  EXPECT_NE(complaint("density = 500\ndensity 400\n").find(":2:"), std::string::npos);
  EXPECT_NE(complaint("density = 500\ndensity = 400\n").find("not TOML"), std::string::npos);
}

TEST_F(SettingsFile, Missing_IsRefused) {
  const std::string what = complaint_of([&] { (void)load_settings(path_); });
  EXPECT_NE(what.find("no such settings file"), std::string::npos) << what;
}

TEST_F(SettingsFile, Folder_IsRefused) {
  std::filesystem::create_directory(path_);
  const std::string what = complaint_of([&] { (void)load_settings(path_); });
  EXPECT_NE(what.find("a folder, expected a settings file"), std::string::npos) << what;
}

TEST_F(SettingsFile, BytesThatAreNoText_AreRefused) {
  EXPECT_NE(complaint(std::string("\xff\xfe\x00\x01", 4)).find("not TOML"), std::string::npos);
}

TEST_F(SettingsFile, SourceAndLines_AreKept) {
  const DollSettings s = load("# by hand\ndensity = 500\n\ntotal_mass = 12\n");
  EXPECT_EQ(s.source, path_.string());
  EXPECT_EQ(s.lines, (std::map<std::string, int>{{"density", 2}}));
  ASSERT_TRUE(s.total_mass);
  EXPECT_EQ(s.total_mass->value, 12.0);
  EXPECT_EQ(s.total_mass->line, 4);
}

TEST_F(SettingsFile, TotalMassOfTheWrongKindOrSize_IsRefused) {
  EXPECT_NE(complaint("total_mass = \"12 kg\"").find(":1: total_mass: expected a number"), std::string::npos);
  for (const std::string value : {"0", "-1", "nan", "inf", "2e6"}) {
    EXPECT_NE(complaint("total_mass = " + value).find("expected (0, 1e+06]"), std::string::npos) << value;
  }
}

TEST(SettingsPath, AnyCharacter_IsBesideItUnderItsName) {
  EXPECT_EQ(settings_path_beside("a/b/doll.glb"), "a/b/doll.doll.toml");
  EXPECT_EQ(settings_path_beside("my.figure.fbx"), "my.figure.doll.toml");
  EXPECT_EQ(settings_path_beside("doll"), "doll.doll.toml");
}

TEST(ValidateSettings, Defaults_AreAllowed) { EXPECT_NO_THROW(validate({})); }

TEST(ValidateSettings, UnknownMaterial_IsRefused) {
  DollSettings settings;
  settings.material = "wod";
  EXPECT_THROW(validate(settings), std::invalid_argument);
}

TEST(ValidateSettings, TotalMassNotPositive_IsRefused) {
  DollSettings settings;
  settings.total_mass = Entry<double>{0.0};
  EXPECT_THROW(validate(settings), std::invalid_argument);
}

TEST(ValidateSettings, NotFinite_IsRefused) {
  DollSettings settings;
  settings.yield_stress = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(validate(settings), std::invalid_argument);
  settings.yield_stress = std::numeric_limits<double>::infinity();
  EXPECT_THROW(validate(settings), std::invalid_argument);
}

}  // namespace
}  // namespace layfigure::doll
