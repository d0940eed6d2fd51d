#include "layfigure/doll/build.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "rig_fixture.h"
#include "solids.h"

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
  const double moment = bar.second_moment();
  EXPECT_LT((section.second_moments - moment * Vector3d(2, 1, 1)).norm(), kRounding);
  EXPECT_LT((section.outermost - bar.radius * Vector3d::Ones()).norm(), kRounding);  // the corners are on the axes
  EXPECT_NEAR(section.span, 0.3, kRounding);
  const Eigen::Matrix3d R = section.axes.toRotationMatrix();
  EXPECT_LT((R.col(0) - Vector3d::UnitY()).norm(), kRounding);
  EXPECT_LT((R.col(1) - Vector3d::UnitZ()).norm(), kRounding);
  EXPECT_GE(section.outline.size(), 4U);
  for (const Vector3d& corner : section.outline) {
    EXPECT_NEAR(corner.y(), 0.0, 1e-4 * bar.bone_length);  // at the joint
    EXPECT_NEAR(std::abs(corner.x()) + std::abs(corner.z()), bar.radius, kRounding);
  }
  const dynamics::JointLaw& law = doll.definition.bodies[1].joint;
  const double twist = 1.0 / (1.0 + settings.poisson_ratio);  // 2 I of shear against I
  EXPECT_NEAR(law.stiffness, settings.elastic_modulus * twist * moment / 0.3, 1e-9 * law.stiffness);
  EXPECT_NEAR(law.damping, settings.viscosity * twist * moment / 0.3, 1e-9 * law.damping);
  EXPECT_LT((law.shape.stiffness - Vector3d(1, 1 / twist, 1 / twist)).norm(), 1e-9);
  EXPECT_NEAR(law.yield_torque, settings.yield_stress * moment / 0.05, 1e-9 * law.yield_torque);
  EXPECT_LT((law.shape.yield - Vector3d(2 / std::numbers::sqrt3, 1, 1)).norm(), 1e-9);
  EXPECT_LT(law.shape.axes.angularDistance(section.axes), 1e-9);
  EXPECT_TRUE(doll.warnings.empty());
}

TEST(BuildDoll, FlatBar_IsStifferEdgewise) {
  // Twice as wide along the world's x, which is the bone's x, as deep along the bone's z.
  const Doll doll = build_doll(test::rig_of(test::box({0.08, 0.04, 0.6}, 10), 0.0), test::without_minima());
  const Section& section = doll.sections[1];
  const double wide = 0.04 * std::pow(0.08, 3) / 12;  // int x^2 dA
  const double deep = 0.08 * std::pow(0.04, 3) / 12;
  EXPECT_LT((section.second_moments - Vector3d(wide + deep, wide, deep)).norm(), 1e-9 * wide);
  EXPECT_LT((section.outermost - Vector3d(std::hypot(0.04, 0.02), 0.04, 0.02)).norm(), kRounding);
  EXPECT_NEAR(std::abs((section.axes * Vector3d::UnitY()).z()), 1.0, kRounding);
  const dynamics::JointShape& shape = doll.definition.bodies[1].joint.shape;
  EXPECT_NEAR(shape.stiffness.y() / shape.stiffness.z(), 4.0, 1e-9);
  EXPECT_NEAR(shape.yield.y() / shape.yield.z(), 2.0, 1e-9);
  EXPECT_EQ(shape.yield.minCoeff(), 1.0);
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

TEST(BuildDoll, BoneWithFlatSkin_CountsAsACapsuleAndIsReported) {
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
  EXPECT_NE(doll.warnings[0].find("bone 'cape': its skin encloses hardly anything"), std::string::npos);
  EXPECT_NE(doll.warnings[0].find("capsule"), std::string::npos);
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
  const double moment = section.area * section.area / (4 * std::numbers::pi);
  EXPECT_LT((section.second_moments - moment * Vector3d(2, 1, 1)).norm(), kRounding);
  EXPECT_TRUE(section.outline.empty());
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
