#include "calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "layfigure/doll/build.h"
#include "rig_fixture.h"
#include "section_law.h"

namespace layfigure::doll {
namespace {

using dynamics::JointLaw;

constexpr double kGravity = 9.81;

bool mentions(const Doll& doll, const std::string& what, const std::string& name) {
  for (const std::string& warning : doll.warnings) {
    if (warning.find(what) != std::string::npos && warning.find(name) != std::string::npos) return true;
  }
  return false;
}

TEST(LimbLoads, BarOfThree_IsAnalytic) {
  const test::Prism bar{.bones = 3, .bone_length = 0.4, .sides = 4, .radius = 0.05};
  DollSettings settings;
  settings.density = 1000.0;
  const Doll doll = build_doll(test::make_prism(bar), settings);
  const auto loads = limb_loads(doll.definition);
  const double mass = 1000.0 * bar.area() * 0.4;
  for (int from = 0; from < 3; ++from) {
    const double length = 0.4 * (3 - from);
    const double total = mass * (3 - from);
    EXPECT_NEAR(loads[from].weight_torque, total * kGravity * length / 2, 1e-9) << from;
    EXPECT_NEAR(loads[from].inertia, total * (length * length / 3 + bar.side() * bar.side() / 12), 1e-9) << from;
  }
}

TEST(LimbLoads, BentArm_CountsAsStretchedOut) {
  character::Rig bent = test::make_prism({.bones = 2});
  bent.bones[1].rest.rotate(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitX()));
  const auto straight_loads = limb_loads(build_doll(test::make_prism({.bones = 2})).definition);
  const auto bent_loads = limb_loads(build_doll(bent).definition);
  EXPECT_NEAR(bent_loads[0].weight_torque, straight_loads[0].weight_torque, 1e-12);
  EXPECT_LT(bent_loads[0].inertia, straight_loads[0].inertia);
}

TEST(Calibration, WeakMaterial_IsRaisedToTheMinima) {
  DollSettings settings;
  settings.elastic_modulus = settings.viscosity = settings.flow_viscosity = settings.yield_stress = 0.0;
  const Doll doll = build_doll(test::make_adult(), settings);
  const auto loads = limb_loads(doll.definition);
  for (std::size_t b = 1; b < loads.size(); ++b) {
    const JointLaw& law = doll.definition.bodies[b].joint;
    EXPECT_DOUBLE_EQ(law.stiffness, loads[b].weight_torque / settings.largest_sag);
    EXPECT_LT(law.yield_torque / law.stiffness, settings.largest_strain);
    EXPECT_DOUBLE_EQ(law.yield_torque, settings.hold_margin * loads[b].weight_torque);
    EXPECT_DOUBLE_EQ(law.damping, 2 * settings.damping_ratio * std::sqrt(law.stiffness * loads[b].inertia));
    EXPECT_DOUBLE_EQ(law.flow_damping, 2 * law.yield_torque / settings.largest_flow_rate);
  }
  EXPECT_TRUE(mentions(doll, "stiffness raised", "left1"));
  EXPECT_TRUE(mentions(doll, "yield torque raised", "left1"));
}

TEST(Calibration, LimberMaterial_IsStiffenedToYieldInTime) {
  DollSettings settings;
  settings.elastic_modulus = 0.0;
  settings.yield_stress = 1e8;
  const Doll doll = build_doll(test::make_adult(), settings);
  for (std::size_t b = 1; b < doll.sections.size(); ++b) {
    const JointLaw& law = doll.definition.bodies[b].joint;
    EXPECT_DOUBLE_EQ(law.stiffness, law.yield_torque / settings.largest_strain);
  }
  EXPECT_TRUE(mentions(doll, "stiffness raised", "left1"));
  EXPECT_FALSE(mentions(doll, "yield torque raised", "left1"));
}

TEST(Calibration, StrongMaterial_IsLeftAlone) {
  DollSettings settings;
  settings.elastic_modulus = 1e8;
  settings.yield_stress = 1e6;
  const Doll doll = build_doll(test::make_adult(), settings);
  EXPECT_TRUE(doll.warnings.empty());
  for (std::size_t b = 1; b < doll.sections.size(); ++b) {
    const AxisLaw law = axis_law(doll.sections[b], settings);
    const JointLaw& joint = doll.definition.bodies[b].joint;
    EXPECT_LT((joint.stiffness * joint.shape.stiffness - law.stiffness).norm(), 1e-12 * law.stiffness.norm());
    EXPECT_LT((joint.yield_torque * joint.shape.yield - law.yield_torque).norm(), 1e-12 * law.yield_torque.norm());
  }
}

/// Flat limbs are weak about one axis and strong about the other: the weak one is raised, the strong one left alone.
TEST(Calibration, FlatLimbs_HoldAboutTheirWeakestAxis) {
  const DollSettings settings;
  const Doll doll = build_doll(test::make_flat_adult(), settings);
  const auto loads = limb_loads(doll.definition);
  bool differ = false;
  for (std::size_t b = 1; b < loads.size(); ++b) {
    const JointLaw& joint = doll.definition.bodies[b].joint;
    const AxisLaw unraised = axis_law(doll.sections[b], settings);
    EXPECT_EQ(joint.shape.yield.minCoeff(), 1.0);
    EXPECT_EQ(joint.shape.stiffness.minCoeff(), 1.0);
    EXPECT_GE(joint.yield_torque, settings.hold_margin * loads[b].weight_torque);
    EXPECT_GE(joint.stiffness, loads[b].weight_torque / settings.largest_sag);
    for (int k = 0; k < 3; ++k) {
      const double yield = joint.yield_torque * joint.shape.yield[k];
      const double least = std::max(unraised.yield_torque[k], settings.hold_margin * loads[b].weight_torque);
      EXPECT_NEAR(yield, least, 1e-12 * least) << joint.shape.yield[k];
      EXPECT_LE(yield, 1.0000001 * settings.largest_strain * joint.stiffness * joint.shape.stiffness[k]);
    }
    differ = differ || joint.shape.yield.maxCoeff() > 1.2;
  }
  EXPECT_TRUE(differ);
}

/// About any axis, by a joint's lever to the wrist. An arm half as deep is as light as it is weak.
TEST(Calibration, DefaultAdult_ArmsYieldToAPullAtTheWrist) {
  const double upper_arm = 0.26;  // [m]
  for (const bool flat : {false, true}) {
    const Doll doll = build_doll(flat ? test::make_flat_adult() : test::make_adult());
    const double least = flat ? 5.0 : 10.0;  // [N]
    const double most = flat ? 50.0 : 25.0;
    for (std::size_t b = 0; b < doll.sections.size(); ++b) {
      const auto& body = doll.definition.bodies[b];
      if (body.name != "left0" && body.name != "left1") continue;
      const double lever = body.name == "left0" ? 2 * upper_arm : upper_arm;
      EXPECT_GT(body.joint.yield_torque / lever, least) << body.name;
      EXPECT_LT(body.joint.yield_torque * body.joint.shape.yield.maxCoeff() / lever, most) << body.name;
    }
  }
}

TEST(Calibration, Root_IsPinnedCriticallyDampedAtTenHertz) {
  const Doll doll = build_doll(test::make_adult());
  double mass = 0.0;
  for (const auto& body : doll.definition.bodies) mass += body.mass;
  const double rate = 2 * std::numbers::pi * 10.0;
  EXPECT_NEAR(doll.root_pin.stiffness, mass * rate * rate, 1e-6 * doll.root_pin.stiffness);
  EXPECT_NEAR(doll.root_pin.damping, 2 * std::sqrt(mass * doll.root_pin.stiffness), 1e-6 * doll.root_pin.damping);
  EXPECT_GT(doll.root_pin.angular_stiffness, 0.0);
  EXPECT_NEAR(doll.root_pin.angular_damping, 2 * doll.root_pin.angular_stiffness / rate,
              1e-6 * doll.root_pin.angular_damping);
}

/// The default doll is to be posed by hand: a hand's force at the wrist bends shoulder and elbow past yield, and the
/// trunk stands it.
TEST(Calibration, DefaultAdult_YieldsToAHandButItsTrunkHolds) {
  const Doll doll = build_doll(test::make_adult());
  const double hand = 100.0;      // [N]
  const double upper_arm = 0.26;  // [m]
  const auto yield = [&](const std::string& name) {
    for (const auto& body : doll.definition.bodies) {
      if (body.name == name) return body.joint.yield_torque;
    }
    return 0.0;
  };
  EXPECT_LT(yield("left0"), 0.5 * hand * 2 * upper_arm);
  EXPECT_LT(yield("left1"), 0.5 * hand * upper_arm);
  // What the shoulder passes on at its own yield does not bend the trunk, 0.16 m wide and 0.15 m below.
  EXPECT_GT(yield("trunk1"), yield("left0") * (1.0 + 0.22 / (2 * upper_arm)));
}

}  // namespace
}  // namespace layfigure::doll
