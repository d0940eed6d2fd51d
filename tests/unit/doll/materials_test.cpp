#include "layfigure/doll/materials.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "calibration.h"
#include "layfigure/doll/build.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

class Materials : public testing::TestWithParam<Material> {};

TEST_P(Materials, Preset_IsFoundAndAllowed) {
  const Material* found = find_material(GetParam().name);
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->density, GetParam().density);
  EXPECT_NO_THROW(validate(settings_of(GetParam())));
  EXPECT_EQ(settings_of(GetParam()).material, GetParam().name);
}

/// The strain at which it yields, and the one at which it comes to rest again in a second.
TEST_P(Materials, Preset_IsAMaterialToPoseWith) {
  const Material& m = GetParam();
  EXPECT_GT(m.density, 100.0);
  EXPECT_LT(m.density, 2000.0);
  EXPECT_GT(m.yield_stress / m.elastic_modulus, 1e-3);
  EXPECT_LT(m.yield_stress / m.elastic_modulus, 0.2);
  EXPECT_LT(m.viscosity / m.elastic_modulus, 0.5);
  EXPECT_LT(m.hardening, 0.1 * m.elastic_modulus);
}

/// A doll of 0.3 m holds its arm, and a hand bends it.
TEST_P(Materials, SmallDoll_HoldsAndYieldsToAHand) {
  const double scale = 0.18;
  const Doll doll = build_doll(test::scaled(test::make_adult(), scale), settings_of(GetParam()));
  const auto loads = limb_loads(doll.definition);
  const double lever = 0.52 * scale;  // shoulder to wrist [m]
  for (std::size_t b = 1; b < loads.size(); ++b) {
    const dynamics::JointLaw& law = doll.definition.bodies[b].joint;
    EXPECT_GE(law.yield_torque, DollSettings{}.hold_margin * loads[b].weight_torque);
    if (doll.definition.bodies[b].name != "left0") continue;
    const double pull = law.yield_torque * law.shape.yield.maxCoeff() / lever;
    EXPECT_GT(pull, 0.1);
    EXPECT_LT(pull, 10.0);
  }
  EXPECT_NO_THROW(dynamics::Model{doll.definition});
}

INSTANTIATE_TEST_SUITE_P(All, Materials, testing::ValuesIn(materials().begin(), materials().end()),
                         [](const auto& test) {
                           std::string name(test.param.name);
                           std::erase(name, ' ');
                           return name;
                         });

/// American beech of 12 % moisture is sold as 720 kg/m^3.
TEST(Wood, OfRoomMoisture_HasItsWaterInItsDensity) { EXPECT_NEAR(find_material("wood")->density, 720.0, 5.0); }

TEST(MaterialNames, AreDifferent) {
  std::set<std::string_view> names;
  for (const Material& material : materials()) names.insert(material.name);
  EXPECT_EQ(names.size(), materials().size());
  EXPECT_EQ(names.size(), 4U);
}

TEST(MaterialNames, Unknown_IsNone) {
  EXPECT_EQ(find_material("wod"), nullptr);
  EXPECT_EQ(find_material(""), nullptr);
}

TEST(MaterialNames, Default_IsSoftVinyl) {
  EXPECT_EQ(default_material().name, "soft vinyl");
  EXPECT_EQ(DollSettings{}.material, "soft vinyl");
  EXPECT_NEAR(DollSettings{}.density, 250.0, 1.0);
}

TEST(WireArmature, Joint_HardensAsItIsBent) {
  const Doll doll = build_doll(test::make_adult(), settings_of(*find_material("wire armature")));
  for (std::size_t b = 1; b < doll.sections.size(); ++b) EXPECT_GT(doll.definition.bodies[b].joint.hardening, 0.0);
  EXPECT_EQ(build_doll(test::make_adult()).definition.bodies[1].joint.hardening, 0.0);
}

}  // namespace
}  // namespace layfigure::doll
