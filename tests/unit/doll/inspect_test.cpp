#include "layfigure/doll/inspect.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "layfigure/doll/build.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

TEST(InspectText, Adult_ListsEveryBodyAndWarning) {
  Doll doll = build_doll(test::make_adult());
  doll.rig.warnings = {"a warning of the import"};
  const std::string text = inspect_text(doll);
  for (const auto& body : doll.definition.bodies) EXPECT_NE(text.find(body.name), std::string::npos) << body.name;
  EXPECT_NE(text.find("8 bones, 8 bodies"), std::string::npos) << text;
  EXPECT_NE(text.find("warning: a warning of the import\n"), std::string::npos);
  EXPECT_EQ(text.back(), '\n');
}

TEST(InspectText, LongNames_AreCutNotOverrun) {
  Doll doll = build_doll(test::make_adult());
  doll.definition.bodies[1].name = std::string(5000, 'n');
  EXPECT_EQ(inspect_text(doll).find(std::string(41, 'n')), std::string::npos);
}

TEST(InspectJson, Adult_HoldsTheNumbersOfTheDoll) {
  const Doll doll = build_doll(test::make_adult());
  const auto json = nlohmann::json::parse(inspect_json(doll));
  EXPECT_EQ(json["bones"], 8);
  ASSERT_EQ(json["bodies"].size(), doll.definition.bodies.size());
  double mass = 0.0;
  for (std::size_t b = 0; b < json["bodies"].size(); ++b) {
    const auto& body = json["bodies"][b];
    const auto& definition = doll.definition.bodies[b];
    EXPECT_EQ(body["name"], definition.name);
    EXPECT_EQ(body["mass"].get<double>(), definition.mass);
    EXPECT_EQ(body["stiffness"].get<double>(), definition.joint.stiffness);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(body["section"]["second_moments"][k].get<double>(), doll.sections[b].second_moments[k]);
      EXPECT_EQ(body["section"]["outermost"][k].get<double>(), doll.sections[b].outermost[k]);
      EXPECT_EQ(body["axis_ratios"]["stiffness"][k].get<double>(), definition.joint.shape.stiffness[k]);
      EXPECT_EQ(body["axis_ratios"]["yield_torque"][k].get<double>(), definition.joint.shape.yield[k]);
    }
    EXPECT_EQ(body["section"]["axes"][0].get<double>(), doll.sections[b].axes.w());
    EXPECT_GT(body["inertia"][0].get<double>(), 0.0);
    mass += definition.mass;
  }
  EXPECT_DOUBLE_EQ(json["mass"].get<double>(), mass);
  EXPECT_TRUE(json["bodies"][0]["parent"].is_null());
  EXPECT_TRUE(json["bodies"][0]["yield_torque"].is_null());
  EXPECT_EQ(json["bodies"][1]["parent"], "trunk0");
  EXPECT_EQ(json["warnings"].size(), doll.warnings.size());
}

TEST(InspectJson, NamesWithQuotesAndBrokenUtf8_AreStillJson) {
  Doll doll = build_doll(test::make_adult());
  doll.definition.bodies[1].name = "say \"x\"\n";
  doll.definition.bodies[2].name = "\xff\xfe";
  const auto json = nlohmann::json::parse(inspect_json(doll));
  EXPECT_EQ(json["bodies"][1]["name"], "say \"x\"\n");
}

}  // namespace
}  // namespace layfigure::doll
