#include "overrides.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <variant>

#include "layfigure/doll/build.h"
#include "rig_fixture.h"
#include "settings_file.h"

namespace layfigure::doll {
namespace {

using dynamics::JointLimits;

constexpr double kDegree = std::numbers::pi / 180.0;

/// Builds the adult of the fixture by settings files.
class Overrides : public test::SettingsFile {
 protected:
  [[nodiscard]] Doll build(const std::string& text) const { return build_doll(test::make_adult(), load(text)); }

  [[nodiscard]] std::string refusal(const std::string& text) const {
    SCOPED_TRACE(text);
    return complaint_of([&] { (void)build(text); });
  }

  [[nodiscard]] static int index_of(const Doll& doll, const std::string& name) {
    for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) {
      if (doll.definition.bodies[b].name == name) return static_cast<int>(b);
    }
    ADD_FAILURE() << "no body " << name;
    return 0;
  }
  [[nodiscard]] static const dynamics::BodyDefinition& body(const Doll& doll, const std::string& name) {
    return doll.definition.bodies[index_of(doll, name)];
  }
  [[nodiscard]] static const Reasons& reasons(const Doll& doll, const std::string& name) {
    return doll.reasons[index_of(doll, name)];
  }

  const Doll plain_ = build_doll(test::make_adult());
};

TEST_F(Overrides, None_LeaveTheDollAsItWas) {
  const Doll doll = build("");
  for (const auto& b : plain_.definition.bodies) {
    EXPECT_EQ(body(doll, b.name).mass, b.mass);
    EXPECT_EQ(body(doll, b.name).joint.stiffness, b.joint.stiffness);
    EXPECT_EQ(body(doll, b.name).limits.twist_upper, b.limits.twist_upper);
    EXPECT_EQ(body(doll, b.name).limits.swing_upper, b.limits.swing_upper);
  }
}

TEST_F(Overrides, ValuesOfTheLaw_ReplaceWhatWasChosen) {
  const Doll doll =
      build("[joints.left1]\nstiffness = 12\ndamping = 0.5\nflow_damping = 3\nyield_torque = 0.25\nhardening = 1.5\n");
  const dynamics::JointLaw& law = body(doll, "left1").joint;
  EXPECT_EQ(law.stiffness, 12.0);
  EXPECT_EQ(law.damping, 0.5);
  EXPECT_EQ(law.flow_damping, 3.0);
  EXPECT_EQ(law.yield_torque, 0.25);
  EXPECT_EQ(law.hardening, 1.5);
  EXPECT_EQ(body(doll, "right1").joint.stiffness, body(plain_, "right1").joint.stiffness);
}

TEST_F(Overrides, WhatWasChosen_IsKeptBesideWhatIsAsked) {
  const Doll doll = build("[joints.left1]\nstiffness = 12\nlimits = {twist = [-5, 5]}\nlocked = [\"twist\"]\n");
  const JointChoice& chosen = doll.chosen_joints[index_of(doll, "left1")];
  const dynamics::BodyDefinition& plain = body(plain_, "left1");
  EXPECT_EQ(body(doll, "left1").joint.stiffness, 12.0);
  EXPECT_EQ(chosen.law.stiffness, plain.joint.stiffness);
  EXPECT_EQ(chosen.law.shape.locked, plain.joint.shape.locked);
  EXPECT_EQ(chosen.limits.twist_upper, plain.limits.twist_upper);
  EXPECT_NE(chosen.limits.twist_upper, body(doll, "left1").limits.twist_upper);
  EXPECT_EQ(doll.chosen_joints.size(), doll.definition.bodies.size());
}

TEST_F(Overrides, Factor_ScalesWhatWasChosen) {
  const Doll doll = build("[joints.\"left*\"]\nyield_torque = {factor = 2.0}\n");
  for (const char* name : {"left0", "left1", "left2"}) {
    EXPECT_EQ(body(doll, name).joint.yield_torque, 2.0 * body(plain_, name).joint.yield_torque) << name;
  }
  EXPECT_EQ(body(doll, "right0").joint.yield_torque, body(plain_, "right0").joint.yield_torque);
}

TEST_F(Overrides, LaterPattern_WinsValueByValue) {
  const Doll doll = build("[joints.\"left*\"]\nstiffness = 1\ndamping = 2\n[joints.\"*1\"]\nstiffness = 3\n");
  EXPECT_EQ(body(doll, "left1").joint.stiffness, 3.0);
  EXPECT_EQ(body(doll, "left1").joint.damping, 2.0);
  EXPECT_EQ(body(doll, "left0").joint.stiffness, 1.0);
}

TEST_F(Overrides, OwnName_WinsOverLaterPatterns) {
  const Doll doll = build("[joints.left1]\nstiffness = 5\n[joints.\"*\"]\nstiffness = 1\n");
  EXPECT_EQ(body(doll, "left1").joint.stiffness, 5.0);
  EXPECT_EQ(body(doll, "right1").joint.stiffness, 1.0);
}

TEST_F(Overrides, NameWithAStar_IsThatBoneAlone) {
  character::Rig rig = test::make_adult();
  rig.bones[3].name = "le*1";
  const DollSettings settings = load("[joints.\"le*1\"]\nstiffness = 5\n[joints.\"left*\"]\nstiffness = 1\n");
  const Doll doll = build_doll(rig, settings);
  EXPECT_EQ(body(doll, "le*1").joint.stiffness, 5.0);
  EXPECT_EQ(body(doll, "left0").joint.stiffness, 1.0);
}

TEST_F(Overrides, PatternForEveryBone_LeavesTheRootsJointAlone) {
  const Doll doll = build("[joints.\"*\"]\nstiffness = 1\n");
  EXPECT_EQ(doll.definition.bodies[0].joint.stiffness, plain_.definition.bodies[0].joint.stiffness);
}

TEST_F(Overrides, Limits_AreMeasuredFromTheRestPoseAboutTheLimb) {
  const Doll doll = build("[joints.left1]\nlimits = {twist = [-30, 20], swing_y = [-10, 140], swing_z = [-5, 180]}\n");
  const dynamics::BodyDefinition& forearm = body(doll, "left1");
  const JointLimits& limits = forearm.limits;
  EXPECT_DOUBLE_EQ(limits.twist_lower, -30 * kDegree);
  EXPECT_DOUBLE_EQ(limits.twist_upper, 20 * kDegree);
  EXPECT_DOUBLE_EQ(limits.swing_lower[0], 10 * kDegree);
  EXPECT_DOUBLE_EQ(limits.swing_upper[0], 140 * kDegree);
  EXPECT_DOUBLE_EQ(limits.swing_lower[1], 5 * kDegree);
  EXPECT_EQ(limits.swing_upper[1], JointLimits::kInfinity);
  const dynamics::LimitState state = dynamics::limit_state(limits, forearm.rest_rotation);
  EXPECT_NEAR(state.twist, 0.0, 1e-12);
  EXPECT_NEAR(state.swing_y_z.norm(), 0.0, 1e-12);
  const Eigen::Vector3d twist_axis = limits.axes * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(twist_axis.dot(forearm.com.normalized()), 1.0, 1e-9);
}

TEST_F(Overrides, LimitsOfAHalfTurn_AreNone) {
  const Doll doll =
      build("[joints.left1]\nlimits = {twist = [-180, 180], swing_y = [-180, 180], swing_z = [-180, 180]}\n");
  EXPECT_FALSE(body(doll, "left1").limits.any());
}

TEST_F(Overrides, LimitsThatExcludeTheRestPose_AreRefused) {
  Doll doll = plain_;
  doll.settings = load("[joints.left1]\nlimits = {twist = [-30, 20], swing_y = [-10, 140]}\n");
  dynamics::BodyDefinition& forearm = doll.definition.bodies[index_of(doll, "left1")];
  // A neutral pose of the doll's choosing, from which the rest pose swings by 20 degrees to one side.
  forearm.limits = {};
  forearm.limits.reference = forearm.rest_rotation * Eigen::AngleAxisd(20 * kDegree, Eigen::Vector3d::UnitY());
  forearm.limits.twist_upper = 1.0;
  const std::vector<JointOverride> overrides = resolve_overrides(doll.settings, doll.rig.bones);
  const std::string what = complaint_of([&] { apply_overrides(overrides, doll); });
  EXPECT_NE(what.find(":2: bone 'left1': limits: the rest pose is outside, at twist 0, swing_y -20, swing_z 0 degrees"),
            std::string::npos)
      << what;
}

TEST_F(Overrides, LimitsOverThoseOfTheDoll_KeepItsAxesAndNeutralPose) {
  Doll doll = plain_;
  doll.settings = load("[joints.left1]\nlimits = {swing_y = [-30, 140]}\n");
  JointLimits& limits = doll.definition.bodies[index_of(doll, "left1")].limits;
  limits.axes = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5);
  limits.reference = body(doll, "left1").rest_rotation;
  limits.twist_upper = 1.0;
  const JointLimits before = limits;
  apply_overrides(resolve_overrides(doll.settings, doll.rig.bones), doll);
  EXPECT_EQ(limits.axes.coeffs(), before.axes.coeffs());
  EXPECT_EQ(limits.reference.coeffs(), before.reference.coeffs());
  EXPECT_EQ(limits.twist_upper, 1.0);
  EXPECT_DOUBLE_EQ(limits.swing_upper[0], 140 * kDegree);
}

TEST_F(Overrides, Locked_TurnsOffAxesOfTheLimb) {
  const Doll doll = build("[joints.\"*\"]\nlocked = [\"twist\"]\n[joints.left2]\nlocked = []\n");
  const dynamics::JointShape& shape = body(doll, "left1").joint.shape;
  EXPECT_EQ(shape.locked, (std::array<bool, 3>{true, false, false}));
  EXPECT_NEAR((shape.axes * Eigen::Vector3d::UnitX()).dot(body(doll, "left1").com.normalized()), 1.0, 1e-9);
  EXPECT_EQ(body(doll, "left2").joint.shape.locked, (std::array<bool, 3>{false, false, false}));
}

TEST_F(Overrides, ShapeAndFriction_AreKeptWithTheBody) {
  const Doll doll =
      build("[joints.\"left*\"]\nshape = \"none\"\nfriction = 0.9\n[joints.left1]\nshape = \"capsule\"\n");
  EXPECT_EQ(doll.matter[index_of(doll, "left0")].shape, ShapeKind::kNone);
  EXPECT_EQ(doll.matter[index_of(doll, "left1")].shape, ShapeKind::kCapsule);
  EXPECT_EQ(doll.matter[index_of(doll, "left1")].friction, 0.9);
  EXPECT_EQ(doll.matter[index_of(doll, "right1")].shape, ShapeKind::kHull);
  EXPECT_EQ(doll.matter[index_of(doll, "right1")].friction, 0.5);
}

TEST_F(Overrides, ShapeAndFriction_AreThoseOfTheContactShapes) {
  const Doll doll =
      build("[joints.\"left*\"]\nshape = \"none\"\nfriction = 0.9\n[joints.left1]\nshape = \"capsule\"\n");
  EXPECT_EQ(doll.shapes.size(), plain_.shapes.size() - 2);  // left0 and left2 have none
  for (const collision::ShapeDefinition& shape : doll.shapes) {
    const bool is_left1 = shape.body == index_of(doll, "left1");
    EXPECT_EQ(std::holds_alternative<collision::Capsule>(shape.shape), is_left1) << shape.name;
    EXPECT_EQ(shape.friction, is_left1 ? 0.9 : 0.5) << shape.name;
    EXPECT_EQ(shape.name, doll.definition.bodies[shape.body].name);
  }
  EXPECT_TRUE(build("[joints.\"*\"]\nshape = \"none\"\n").shapes.empty());
}

TEST_F(Overrides, DensityAndMass_ScaleMassAndInertiaAndTheWeightToBeHeld) {
  const Doll doll = build("[joints.left2]\ndensity = 500\n[joints.right2]\nmass = 2\n");
  EXPECT_NEAR(body(doll, "left2").mass, 500 / plain_.settings.density * body(plain_, "left2").mass, 1e-12);
  EXPECT_NEAR(body(doll, "right2").mass, 2.0, 1e-12);
  const double times = 2.0 / body(plain_, "right2").mass;
  EXPECT_NEAR(body(doll, "right2").inertia(0, 0), times * body(plain_, "right2").inertia(0, 0), 1e-12);
  EXPECT_GT(body(doll, "right0").joint.yield_torque, body(plain_, "right0").joint.yield_torque);
}

TEST_F(Overrides, MassAfterDensity_ReplacesItAndTheOtherWayRound) {
  const Doll doll = build("[joints.\"*\"]\ndensity = 900\n[joints.left2]\nmass = 2\n");
  EXPECT_NEAR(body(doll, "left2").mass, 2.0, 1e-12);
  const Doll other = build("[joints.\"*2\"]\nmass = 2\n[joints.\"left?\"]\ndensity = 500\n");
  EXPECT_NEAR(body(other, "left2").mass, 500 / plain_.settings.density * body(plain_, "left2").mass, 1e-12);
  EXPECT_NEAR(body(other, "right2").mass, 2.0, 1e-12);
}

TEST_F(Overrides, TotalMass_IsThatOfTheWholeDoll) {
  const Doll doll = build("total_mass = 12\n[joints.left2]\nmass = 2\n[joints.right2]\ndensity = 1000\n");
  double mass = 0.0;
  for (const auto& b : doll.definition.bodies) mass += b.mass;
  EXPECT_NEAR(mass, 12.0, 1e-12);
  EXPECT_NEAR(body(doll, "left2").mass, 2.0, 1e-12);
  EXPECT_NEAR(body(doll, "right2").mass / body(doll, "right1").mass,
              1000 / plain_.settings.density * body(plain_, "right2").mass / body(plain_, "right1").mass, 1e-9);
}

TEST_F(Overrides, TotalMassWithoutRoom_IsRefused) {
  const std::string less = refusal("total_mass = 3\n[joints.\"left*\"]\nmass = 1\n");
  EXPECT_NE(less.find(":1: total_mass = 3, expected more than the 3 kg"), std::string::npos) << less;
  const std::string all = refusal("total_mass = 30\n[joints.\"*\"]\nmass = 1\n");
  EXPECT_NE(all.find("and a body whose mass is not"), std::string::npos) << all;
}

TEST_F(Overrides, MassOfAnImpossibleDensity_IsRefused) {
  const std::string what = refusal("[joints.left2]\nmass = 1e6\n");
  EXPECT_NE(what.find(":2: bone 'left2': mass: density of that mass = "), std::string::npos) << what;
  EXPECT_NE(refusal("total_mass = 1e6\n").find(":1: total_mass: density of that mass = "), std::string::npos);
}

TEST_F(Overrides, PatternWithoutMatch_IsRefusedWithNearNames) {
  const std::string what = refusal("density = 250\n\n[joints.left7]\nstiffness = 1\n");
  EXPECT_NE(what.find(":3: [joints.\"left7\"] matches no bone; near names: 'left0', 'left1', 'left2'"),
            std::string::npos)
      << what;
  const std::string far = refusal("[joints.\"*Tentacle*\"]\nstiffness = 1\n");
  EXPECT_NE(far.find("matches no bone; the bones are 'trunk0', 'trunk1', 'left0', 'left1', 'left2', ..."),
            std::string::npos)
      << far;
  EXPECT_NE(refusal("[joints.\"\"]\n").find("matches no bone"), std::string::npos);
}

TEST_F(Overrides, JointOfTheRoot_IsRefused) {
  const std::string what = refusal("[joints.trunk0]\nstiffness = 1\n");
  EXPECT_NE(what.find(":1: [joints.\"trunk0\"] no joint: 'trunk0' is the doll's root"), std::string::npos) << what;
  EXPECT_NO_THROW((void)build("[joints.trunk0]\ndensity = 100\n"));
}

TEST_F(Overrides, ValuesForABoneThatRides_AreRefused) {
  character::Rig rig = test::make_adult();
  character::Bone tip;
  tip.name = "tip";
  tip.parent = 4;
  rig.bones.push_back(tip);
  for (const std::string line : {"stiffness = 1", "friction = 1"}) {
    const DollSettings settings = load("[joints.tip]\n" + line + "\n");
    const std::string what = complaint_of([&] { (void)build_doll(rig, settings); });
    EXPECT_NE(what.find(":1: [joints.\"tip\"] no body: 'tip' rides on its parent's"), std::string::npos) << what;
  }
  const DollSettings settings = load("[joints.\"*\"]\nfriction = 1\n");
  EXPECT_NO_THROW((void)build_doll(rig, settings));
}

TEST_F(Overrides, MergeThatCannotBe_IsRefused) {
  character::Rig rig = test::make_adult();
  character::Bone tip;
  tip.name = "tip";
  tip.parent = 4;
  rig.bones.push_back(tip);
  const DollSettings as_body = load("[joints.tip]\nmerge = false\n");
  const std::string what = complaint_of([&] { (void)build_doll(rig, as_body); });
  EXPECT_NE(what.find(":2: merge: bone 'tip' cannot be a body: hardly any skin"), std::string::npos) << what;
  const std::string root = refusal("[joints.trunk0]\nmerge = true\n");
  EXPECT_NE(root.find(":2: merge: bone 'trunk0' has no parent"), std::string::npos) << root;
  const DollSettings as_rider = load("[joints.tip]\nmerge = true\n");
  EXPECT_EQ(build_doll(rig, as_rider).body_reasons.back().text, "line 2 of the settings");
}

TEST_F(Overrides, Merge_DecidesWhatTheBodiesAre) {
  const Doll doll = build("[joints.left2]\nmerge = true\n");
  EXPECT_EQ(doll.definition.bodies.size(), plain_.definition.bodies.size() - 1);
  for (std::size_t bone = 0; bone < doll.rig.bones.size(); ++bone) {
    if (doll.rig.bones[bone].name != "left2") continue;
    EXPECT_EQ(doll.body_of_bone[bone], -1);
    EXPECT_EQ(doll.carriers[bone].body, index_of(doll, "left1"));
    EXPECT_EQ(doll.body_reasons[bone].text, "line 2 of the settings");
  }
}

TEST_F(Overrides, Law_KeepsTheRatiosOfItsAxes) {
  const std::string stiff = "elastic_modulus = 1e12\nyield_stress = 1e9\n";  // nothing is raised, which makes round
  const Doll flat = build_doll(test::make_flat_adult(), load(stiff));
  const DollSettings settings = load(stiff + "[joints.left1]\nstiffness = 12\ndamping = 0.5\nyield_torque = 0.25\n");
  const Doll doll = build_doll(test::make_flat_adult(), settings);
  const dynamics::JointShape& shape = body(doll, "left1").joint.shape;
  const dynamics::JointShape& chosen = body(flat, "left1").joint.shape;
  EXPECT_GT(chosen.stiffness.maxCoeff(), 1.0);
  EXPECT_EQ(shape.stiffness, chosen.stiffness);
  EXPECT_EQ(shape.yield, chosen.yield);
}

Eigen::Vector3d stiffness_of(const dynamics::JointLaw& law) { return law.stiffness * law.shape.stiffness; }

TEST_F(Overrides, ValuesOfSingleAxes_LeaveTheOthers) {
  const Doll doll = build("[joints.left1]\nstiffness = {twist = 7, bend_z = {factor = 3}}\ndamping = {bend_y = 0}\n");
  const Eigen::Vector3d chosen = stiffness_of(body(plain_, "left1").joint);
  const dynamics::JointLaw& law = body(doll, "left1").joint;
  EXPECT_LT((stiffness_of(law) - Eigen::Vector3d(7.0, chosen.y(), 3.0 * chosen.z())).norm(), 1e-12 * chosen.norm());
  EXPECT_EQ(law.shape.stiffness.minCoeff(), 1.0);
  EXPECT_EQ(law.shape.damping[1], 0.0);
  EXPECT_EQ(law.shape.damping.maxCoeff(), 1.0);
  EXPECT_EQ(law.yield_torque, body(plain_, "left1").joint.yield_torque);
  EXPECT_EQ(reasons(doll, "left1").stiffness.origin, Origin::kSettings);
  EXPECT_EQ(reasons(doll, "left1").stiffness.text,
            "twist and bend_z by line 2 of the settings, else " + reasons(plain_, "left1").stiffness.text);
}

TEST_F(Overrides, AxesThatNeverYieldOrAreRigid_AreInfiniteMultiples) {
  const Doll doll = build("[joints.left1]\nyield_torque = {twist = inf}\nstiffness = {bend_y = inf}\n");
  const dynamics::JointLaw& law = body(doll, "left1").joint;
  EXPECT_TRUE(std::isinf(law.shape.yield[0]));
  EXPECT_NEAR(law.shape.yield[1], 1.0, 1e-12);
  EXPECT_EQ(law.yield_torque, body(plain_, "left1").joint.yield_torque);
  EXPECT_DOUBLE_EQ(stiffness_of(law)[1], dynamics::kRigidStiffness);
  EXPECT_NO_THROW(dynamics::Model{doll.definition});
}

TEST_F(Overrides, SingleAxesAndAllOfThem_ReplaceEachOther) {
  const std::string axes = "stiffness = {twist = 7}\n";
  const Doll all_last = build("[joints.\"left*\"]\n" + axes + "[joints.\"*1\"]\nstiffness = 3\n");
  EXPECT_EQ(stiffness_of(body(all_last, "left1").joint).minCoeff(), 3.0);
  const Doll axes_last = build("[joints.\"left*\"]\nstiffness = 3\n[joints.\"*1\"]\n" + axes);
  EXPECT_EQ(stiffness_of(body(axes_last, "left1").joint).x(), 7.0);
  EXPECT_DOUBLE_EQ(stiffness_of(body(axes_last, "left1").joint).y(), stiffness_of(body(plain_, "left1").joint).y());
}

TEST_F(Overrides, SingleAxesOfTheRoot_AreRefused) {
  EXPECT_NE(refusal("[joints.trunk0]\nyield_torque = {twist = 1}\n").find("no joint"), std::string::npos);
}

TEST_F(Overrides, MergeChoices_AreThoseOfMerge) {
  const std::vector<character::Bone> bones = test::make_adult().bones;
  const DollSettings settings = load("[joints.\"*1\"]\nmerge = true\n[joints.left1]\nmerge = false\n");
  const std::vector<MergeChoice> choices = merge_choices(resolve_overrides(settings, bones));
  ASSERT_EQ(choices.size(), bones.size());
  for (std::size_t bone = 0; bone < bones.size(); ++bone) {
    const std::string& name = bones[bone].name;
    const MergeChoice expected = name == "left1"      ? MergeChoice::kBody
                                 : name.back() == '1' ? MergeChoice::kMerge
                                                      : MergeChoice::kAutomatic;
    EXPECT_EQ(choices[bone], expected) << name;
  }
}

TEST_F(Overrides, Reasons_NameWhatChose) {
  DollSettings weak;
  weak.elastic_modulus = weak.yield_stress = weak.viscosity = weak.flow_viscosity = 0.0;
  const Reasons raised = reasons(build_doll(test::make_adult(), weak), "left1");
  EXPECT_EQ(raised.yield_torque.origin, Origin::kRaised);
  EXPECT_EQ(raised.yield_torque.text, "raised to hold the limb's weight");
  EXPECT_EQ(raised.stiffness.text, "raised to bear the limb's weight");
  EXPECT_EQ(raised.damping.origin, Origin::kRaised);
  EXPECT_EQ(raised.flow_damping.origin, Origin::kRaised);
  const Doll doll = build("[joints.left1]\nstiffness = 5\n\nyield_torque = {factor = 3}\n");
  EXPECT_EQ(reasons(doll, "left1").stiffness.origin, Origin::kSettings);
  EXPECT_EQ(reasons(doll, "left1").stiffness.text, "line 2 of the settings");
  EXPECT_EQ(reasons(doll, "left1").yield_torque.text, "3 times what was chosen, line 4 of the settings");
  EXPECT_EQ(reasons(doll, "left1").hardening.origin, Origin::kDefault);
  const Doll bar = build_doll(test::make_prism({.bones = 2}), test::without_minima());
  EXPECT_EQ(bar.reasons[1].stiffness.origin, Origin::kSection);
  EXPECT_EQ(bar.reasons[1].stiffness.text, "section");
}

TEST_F(Overrides, RaisedButGivenInTheEnd_IsNotReported) {
  const auto reported = [](const Doll& doll, const std::string& what) {
    for (const std::string& warning : doll.warnings) {
      if (warning.find(what) != std::string::npos && warning.find("left1") != std::string::npos) return true;
    }
    return false;
  };
  EXPECT_TRUE(reported(build("elastic_modulus = 0\nyield_stress = 0\n"), "raised"));
  EXPECT_FALSE(reported(
      build("elastic_modulus = 0\nyield_stress = 0\n[joints.left1]\nstiffness = 1\nyield_torque = 1\n"), "raised"));
}

TEST(OverridesWithoutAFile, Refused_NameTheSettings) {
  DollSettings settings;
  settings.joints.push_back({.pattern = "none"});
  try {
    (void)build_doll(test::make_adult(), settings);
    ADD_FAILURE() << "accepted";
  } catch (const SettingsError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("doll settings: [joints.\"none\"] matches no bone", 0), 0U)
        << error.what();
  }
}

}  // namespace
}  // namespace layfigure::doll
