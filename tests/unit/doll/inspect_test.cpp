#include "layfigure/doll/inspect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

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

TEST(InspectText, Adult_MarksWhereNumbersComeFrom) {
  DollSettings settings;
  settings.source = "soft.toml";
  settings.joints.push_back({.pattern = "left1", .stiffness = Entry<Amount>{{4321.0, false}, 3}});
  const std::string text = inspect_text(build_doll(test::make_adult(), settings));
  EXPECT_NE(text.find("settings: soft.toml\n"), std::string::npos) << text;
  EXPECT_NE(text.find(" 4321= "), std::string::npos) << text;
  EXPECT_NE(text.find("+"), std::string::npos) << text;
  EXPECT_NE(text.find("= by the settings"), std::string::npos) << text;
  EXPECT_EQ(text.find(" \n"), std::string::npos) << "spaces at the end of a line";
}

TEST(InspectText, AxesThatDiffer_AreToldAsMultiples) {
  DollSettings settings;
  settings.joints.push_back(
      {.pattern = "left1",
       .yield_torque_axes = Entry<AxisAmounts>{{Amount{6.0, false}, Amount{2.0, false}, Amount{3.0, false}}, 3}});
  const std::string text = inspect_text(build_doll(test::make_adult(), settings));
  EXPECT_NE(text.find(" 3:1:1.5 "), std::string::npos) << text;
}

TEST(InspectText, LimitsAndLocks_AreInDegreesAndByName) {
  DollSettings settings;
  settings.joints.push_back({.pattern = "left1",
                             .twist = Entry<AngleRange>{{-0.5 * std::numbers::pi, 0.25 * std::numbers::pi}, 3},
                             .locked = Entry<std::array<bool, 3>>{{false, true, true}, 4}});
  const std::string text = inspect_text(build_doll(test::make_adult(), settings));
  EXPECT_NE(text.find("-90..45="), std::string::npos) << text;
  EXPECT_NE(text.find("bend_y,bend_z="), std::string::npos) << text;
}

TEST(InspectText, BonesThatRide_AreListedWithTheReason) {
  character::Rig rig = test::make_adult();
  character::Bone tip;
  tip.name = "tip";
  tip.parent = 4;
  rig.bones.push_back(tip);
  tip.name = "elsewhere";
  tip.parent = -1;
  rig.bones.push_back(tip);
  const std::string text = inspect_text(build_doll(rig));
  EXPECT_NE(text.find("\ntip rides on left2: no skin\n"), std::string::npos) << text;
  EXPECT_NE(text.find("\nelsewhere stays where it is: "), std::string::npos) << text;
  const auto json = nlohmann::json::parse(inspect_json(build_doll(rig)));
  ASSERT_EQ(json["merged"].size(), 2U);
  EXPECT_EQ(json["merged"][0]["bone"], "tip");
  EXPECT_EQ(json["merged"][0]["body"], "left2");
  EXPECT_TRUE(json["merged"][1]["body"].is_null());
}

TEST(InspectJson, SettingsLimitsAndReasons_AreTold) {
  DollSettings settings;
  settings.source = "soft.toml";
  settings.total_mass = Entry<double>{12.0, 1};
  settings.joints.push_back({.pattern = "left1",
                             .yield_torque = Entry<Amount>{{std::numeric_limits<double>::infinity(), false}, 3},
                             .twist = Entry<AngleRange>{{-0.5, 0.25}, 4},
                             .locked = Entry<std::array<bool, 3>>{{true, false, false}, 5},
                             .shape = Entry<ShapeKind>{ShapeKind::kCapsule, 6}});
  const Doll doll = build_doll(test::make_adult(), settings);
  const auto json = nlohmann::json::parse(inspect_json(doll));
  EXPECT_EQ(json["settings"]["source"], "soft.toml");
  EXPECT_EQ(json["settings"]["total_mass"], 12.0);
  EXPECT_EQ(json["settings"]["hold_margin"], settings.hold_margin);
  EXPECT_NEAR(json["mass"].get<double>(), 12.0, 1e-9);
  for (const auto& body : json["bodies"]) {
    const bool is_left1 = body["name"] == "left1";
    EXPECT_EQ(body["limits"].is_null(), body["parent"].is_null());
    EXPECT_EQ(body["shape"], is_left1 ? "capsule" : "hull");
    if (!is_left1) continue;
    EXPECT_TRUE(body["yield_torque"].is_null());
    EXPECT_EQ(body["limits"]["twist"], (nlohmann::json{-0.5, 0.25}));
    EXPECT_EQ(body["locked"], nlohmann::json{"twist"});
    EXPECT_EQ(body["reasons"]["yield_torque"], "line 3 of the settings");
    EXPECT_EQ(body["reasons"]["limits"]["twist"], "line 4 of the settings");
    EXPECT_EQ(body["reasons"]["limits"]["swing_y"], "range of an unknown part");
  }
}

TEST(InspectJson, Default_HasNoSourceAndNoGeometry) {
  const auto json = nlohmann::json::parse(inspect_json(build_doll(test::make_adult())));
  EXPECT_TRUE(json["settings"]["source"].is_null());
  EXPECT_TRUE(json["settings"]["total_mass"].is_null());
  EXPECT_FALSE(json.contains("geometry"));
  EXPECT_TRUE(json["merged"].empty());
}

Eigen::Vector3d point_of(const nlohmann::json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

TEST(InspectJson, WithGeometry_HasTheSkinTheSectionsAndTheEllipsoidsInTheWorld) {
  const test::Prism bar{.bones = 2, .bone_length = 0.3, .sides = 4, .radius = 0.05, .pose = test::odd_motion()};
  const Doll doll = build_doll(test::make_prism(bar));
  const std::string text = inspect_json(doll, true);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  const auto geometry = nlohmann::json::parse(text)["geometry"];
  ASSERT_EQ(geometry["vertices"].size(), 36U);
  ASSERT_EQ(geometry["triangles"].size(), geometry["body_of_triangle"].size());
  ASSERT_EQ(geometry["bodies"].size(), 2U);
  const Eigen::Vector3d along = bar.pose.linear().col(2);
  for (int b = 0; b < 2; ++b) {
    const auto& body = geometry["bodies"][b];
    const Eigen::Vector3d com = bar.pose * Eigen::Vector3d(0, 0, 0.15 + 0.3 * b);
    EXPECT_LT((point_of(body["com"]) - com).norm(), 1e-9);
    // Of a box with sides a, a, l: semi-axes sqrt(5 / 12) times the sides.
    std::vector<double> lengths;
    for (const auto& axis : body["semi_axes"]) lengths.push_back(point_of(axis).norm());
    std::sort(lengths.begin(), lengths.end());
    EXPECT_NEAR(lengths[0], std::sqrt(5.0 / 12.0) * bar.side(), 1e-9);
    EXPECT_NEAR(lengths[2], std::sqrt(5.0 / 12.0) * 0.3, 1e-9);
  }
  const Eigen::Vector3d joint = bar.pose * Eigen::Vector3d(0, 0, 0.3);
  ASSERT_GE(geometry["bodies"][1]["section"].size(), 4U);
  for (const auto& corner : geometry["bodies"][1]["section"]) {
    EXPECT_NEAR((point_of(corner) - joint).dot(along), 0.0, 1e-4);  // cut a little beyond it
    EXPECT_LE((point_of(corner) - joint).norm(), 0.05 + 1e-6);
  }
  for (std::size_t t = 0; t < geometry["triangles"].size(); ++t) {
    const auto& triangle = geometry["triangles"][t];
    double height = 0.0;
    for (int k = 0; k < 3; ++k) {
      height += (point_of(geometry["vertices"][triangle[k].get<int>()]) - bar.pose.translation()).dot(along) / 3.0;
    }
    EXPECT_EQ(geometry["body_of_triangle"][t].get<int>(), height > 0.3 ? 1 : 0) << height;
  }
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
