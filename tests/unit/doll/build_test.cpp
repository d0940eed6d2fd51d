#include "layfigure/doll/build.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <numbers>
#include <stdexcept>

#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using dynamics::BodyDefinition;
using Eigen::Vector3d;

constexpr double kRounding = 1e-12;

TEST(BuildDoll, SquareBar_HasTheMassOfItsBoxes) {
  const test::Prism bar{.bones = 2, .bone_length = 0.3, .sides = 4, .radius = 0.05};
  DollSettings settings;
  settings.density = 500.0;
  const Doll doll = build_doll(test::make_prism(bar), settings);
  ASSERT_EQ(doll.definition.bodies.size(), 2U);
  const double mass = 500.0 * bar.area() * bar.bone_length;
  const double across = mass * (bar.side() * bar.side() + bar.bone_length * bar.bone_length) / 12.0;
  const double along = mass * bar.side() * bar.side() / 6.0;
  for (const BodyDefinition& body : doll.definition.bodies) {
    EXPECT_NEAR(body.mass, mass, kRounding) << body.name;
    EXPECT_LT((body.com - Vector3d(0, 0.15, 0)).norm(), kRounding) << body.name;  // Y along the bone
    EXPECT_LT((body.inertia - Eigen::Matrix3d(Vector3d(across, along, across).asDiagonal())).norm(), kRounding);
  }
}

TEST(BuildDoll, SquareBar_HasItsSectionAndTheLawOfTheMaterial) {
  const test::Prism bar{.bones = 2, .bone_length = 0.3, .sides = 4, .radius = 0.05};
  const DollSettings settings = test::without_minima();
  const Doll doll = build_doll(test::make_prism(bar), settings);
  const Section& section = doll.sections[1];
  EXPECT_FALSE(section.estimated);
  EXPECT_NEAR(section.area, bar.area(), kRounding);
  EXPECT_NEAR(section.second_moment, bar.second_moment(), kRounding);
  EXPECT_NEAR(section.outermost, bar.radius, kRounding);
  EXPECT_NEAR(section.span, 0.3, kRounding);
  const double pattern = bar.second_moment() / 0.3;
  const dynamics::JointLaw& law = doll.definition.bodies[1].joint;
  EXPECT_NEAR(law.stiffness, settings.elastic_modulus * pattern, 1e-9 * law.stiffness);
  EXPECT_NEAR(law.damping, settings.viscosity * pattern, 1e-9 * law.damping);
  EXPECT_NEAR(law.flow_damping, settings.flow_viscosity * pattern, 1e-9 * law.flow_damping);
  EXPECT_NEAR(law.yield_torque, settings.yield_stress * bar.second_moment() / 0.05, 1e-9 * law.yield_torque);
  EXPECT_TRUE(doll.warnings.empty());
}

TEST(BuildDoll, Cylinder_HasTheSecondMomentOfACircle) {
  const Doll doll = build_doll(test::make_prism({.bones = 2, .sides = 256, .radius = 0.1}), test::without_minima());
  const double circle = std::numbers::pi * 1e-4 / 4.0;
  EXPECT_NEAR(doll.sections[1].second_moment, circle, 1e-3 * circle);
}

TEST(BuildDoll, RigMoved_OnlyTheRootMoves) {
  const Doll here = build_doll(test::make_adult());
  const Doll there = build_doll(test::moved(test::make_adult(), test::odd_motion()));
  ASSERT_EQ(here.definition.bodies.size(), there.definition.bodies.size());
  for (std::size_t b = 0; b < here.definition.bodies.size(); ++b) {
    const BodyDefinition& a = here.definition.bodies[b];
    const BodyDefinition& c = there.definition.bodies[b];
    EXPECT_NEAR(a.mass, c.mass, 1e-9 * a.mass) << a.name;
    EXPECT_LT((a.com - c.com).norm(), 1e-9) << a.name;
    EXPECT_LT((a.inertia - c.inertia).norm(), 1e-9 * a.inertia.norm()) << a.name;
    EXPECT_NEAR(a.joint.stiffness, c.joint.stiffness, 1e-9 * a.joint.stiffness) << a.name;
    if (a.parent < 0) continue;
    EXPECT_NEAR(a.joint.yield_torque, c.joint.yield_torque, 1e-9 * a.joint.yield_torque) << a.name;
    EXPECT_LT((a.anchor - c.anchor).norm(), 1e-9) << a.name;
    EXPECT_LT(a.rotation.angularDistance(c.rotation), 1e-7) << a.name;
  }
  EXPECT_LT((there.definition.bodies[0].anchor - test::odd_motion() * here.definition.bodies[0].anchor).norm(), 1e-9);
}

TEST(BuildDoll, Adult_HasTheVolumeOfItsMesh) {
  const Doll doll = build_doll(test::make_adult());
  double mass = 0.0;
  for (const BodyDefinition& body : doll.definition.bodies) mass += body.mass;
  const test::Prism trunk{.sides = 24, .radius = 0.13};
  const test::Prism arm{.sides = 16, .radius = 0.045};
  EXPECT_NEAR(mass, DollSettings{}.density * (trunk.area() * 0.6 + 2 * arm.area() * 0.78), 1e-9);
}

TEST(BuildDoll, Adult_IsAModel) {
  const Doll doll = build_doll(test::make_adult());
  EXPECT_EQ(doll.definition.root, dynamics::RootKind::kFree);
  const dynamics::Model model(doll.definition);
  EXPECT_EQ(model.size(), 8);
  EXPECT_EQ(doll.sections.size(), 8U);
  EXPECT_EQ(doll.carriers.size(), doll.rig.bones.size());
}

TEST(BuildDoll, RestPoseOtherThanBind_StartsInTheRestPose) {
  character::Rig rig = test::make_prism({.bones = 2});
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Vector3d::UnitX()));
  rig.bones[1].rest.rotate(turn);
  const BodyDefinition body = build_doll(rig).definition.bodies[1];
  EXPECT_LT(body.rotation.angularDistance(turn), 1e-12);
  EXPECT_LT(body.rest_rotation.angularDistance(turn), 1e-12);
  EXPECT_LT((body.com - Vector3d(0, 0.15, 0)).norm(), kRounding);  // in the bone's axes, as bound
}

TEST(BuildDoll, BoneWithFlatSkin_CountsAsAnEllipsoidAndIsReported) {
  character::Rig rig = test::make_prism({.bones = 1});
  character::Bone cape;
  cape.name = "cape";
  cape.parent = 0;
  rig.bones.push_back(cape);
  character::SkinnedMesh sheet;
  sheet.vertices = {{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}, {0.5, 1, 0.5}};
  sheet.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  sheet.influences.assign(5, {{1, 1.0}});
  rig.meshes.push_back(sheet);
  const Doll doll = build_doll(rig);
  ASSERT_EQ(doll.definition.bodies.size(), 2U);
  EXPECT_GT(doll.definition.bodies[1].mass, 0.0);
  ASSERT_FALSE(doll.warnings.empty());
  EXPECT_NE(doll.warnings[0].find("bone 'cape'"), std::string::npos);
  EXPECT_NO_THROW(dynamics::Model{doll.definition});
}

TEST(BuildDoll, BoneOutweighedByOnesThatRideTogether_KeepsItsSkin) {
  // bone1 weighs most on its skin of all bones, but less than the two without skin of their own that ride on bone0.
  character::Rig rig = test::make_prism({.bones = 2});
  for (const char* name : {"twist0", "twist1"}) {
    character::Bone twist;
    twist.name = name;
    twist.parent = 0;
    rig.bones.push_back(twist);
  }
  for (auto& influences : rig.meshes[0].influences) {
    if (influences[0].bone == 1) influences = {{1, 0.4}, {2, 0.3}, {3, 0.3}};
  }
  const Doll doll = build_doll(rig);
  ASSERT_EQ(doll.definition.bodies.size(), 2U);
  EXPECT_NEAR(doll.definition.bodies[1].mass, doll.definition.bodies[0].mass, 0.3 * doll.definition.bodies[0].mass);
  EXPECT_NO_THROW(dynamics::Model{doll.definition});
}

TEST(BuildDoll, SkinThatDoesNotReachTheJoint_SectionIsEstimatedAndReported) {
  const test::Prism prism{.prefix = "far", .bones = 1, .pose = Eigen::Isometry3d(Eigen::Translation3d(0, 0, 1))};
  character::Rig rig = test::make_prism({.bones = 1});
  test::add_prism(rig, prism, 0);
  rig.bones[1].bind.translation().z() = 0.6;
  rig.bones[1].rest = rig.bones[0].bind.inverse() * rig.bones[1].bind;
  const Doll doll = build_doll(rig);
  const Section& section = doll.sections[1];
  EXPECT_TRUE(section.estimated);
  // As thick as its volume spread from the joint to as far behind the com.
  EXPECT_NEAR(section.area, prism.area() * prism.bone_length / (2 * 0.55), 1e-9);
  EXPECT_NEAR(section.second_moment, section.area * section.area / (4 * std::numbers::pi), 1e-12);
  ASSERT_FALSE(doll.warnings.empty());
  EXPECT_NE(doll.warnings[0].find("bone 'far0': no section found"), std::string::npos);
}

TEST(BuildDoll, BadSettings_AreRefused) {
  DollSettings settings;
  settings.density = -1.0;
  EXPECT_THROW((void)build_doll(test::make_adult(), settings), std::invalid_argument);
}

TEST(BuildDoll, RigWithoutSkin_IsRefused) {
  character::Rig rig = test::make_prism({});
  rig.meshes.clear();
  EXPECT_THROW((void)build_doll(rig), std::invalid_argument);
}

}  // namespace
}  // namespace layfigure::doll
