#include <gtest/gtest.h>

#include "layfigure/doll/build.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using character::Bone;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kAngle = 1e-7;  // angularDistance loses half the digits
constexpr double kPlace = 1e-12;

/// The adult with a bone without skin above the trunk (bone 0), one between trunk and arms (the clavicle, bone 3), and
/// one at the end of a hand (the last).
character::Rig adult_with_riders() {
  const character::Rig adult = test::make_adult();
  character::Rig rig;
  const auto add = [&](const std::string& name, int parent, const Isometry3d& bind) {
    Bone bone;
    bone.name = name;
    bone.parent = parent;
    bone.bind = bind;
    bone.rest = parent < 0 ? bind : rig.bones[parent].bind.inverse() * bind;
    rig.bones.push_back(bone);
  };
  add("above", -1, test::odd_motion());
  for (int b = 0; b < 2; ++b) add(adult.bones[b].name, b, adult.bones[b].bind);
  add("clavicle", 2, Eigen::Translation3d(0, 0, 1.4) * Eigen::AngleAxisd(0.4, Vector3d::UnitX()));
  for (int b = 2; b < 8; ++b) add(adult.bones[b].name, b % 3 == 2 ? 3 : b + 1, adult.bones[b].bind);
  add("nail", 6, adult.bones[4].bind * Eigen::Translation3d(0, 0.26, 0) * Eigen::AngleAxisd(1, Vector3d::UnitY()));
  rig.meshes = adult.meshes;
  for (auto& mesh : rig.meshes) {
    for (auto& influences : mesh.influences) {
      for (auto& influence : influences) influence.bone += influence.bone < 2 ? 1 : 2;
    }
  }
  return rig;
}

/// World poses of the bones by forward kinematics over the skeleton, as a USD reader does it.
std::vector<Isometry3d> forward(const character::Rig& rig, const SkeletonPose& pose) {
  std::vector<Isometry3d> world;
  for (std::size_t b = 0; b < rig.bones.size(); ++b) {
    const Bone& bone = rig.bones[b];
    Isometry3d local = Isometry3d::Identity();
    local.linear() = pose.rotations[b].toRotationMatrix();
    local.translation() = bone.parent < 0 ? pose.root_translation : Vector3d(bone.rest.translation());
    world.push_back(bone.parent < 0 ? local : world[bone.parent] * local);
  }
  return world;
}

/// Turns every body somehow.
dynamics::State disturbed(const dynamics::Model& model) {
  dynamics::State state = dynamics::initial_state(model);
  for (std::size_t b = 0; b < state.bodies.size(); ++b) {
    const double angle = 0.3 + 0.1 * static_cast<double>(b);
    state.bodies[b].rotation =
        state.bodies[b].rotation * Quaterniond(Eigen::AngleAxisd(angle, Vector3d(1, 2, -1).normalized()));
    state.bodies[b].rest_rotation =
        state.bodies[b].rest_rotation * Quaterniond(Eigen::AngleAxisd(-angle, Vector3d::UnitZ()));
    state.bodies[b].torque = Vector3d(angle, 0, 0);
    state.bodies[b].yielding = b % 2 == 1;
  }
  state.bodies[0].position += Vector3d(0.1, 0.2, 0.3);
  return state;
}

TEST(SkeletonPose, AtTheStart_IsTheRestPose) {
  const Doll doll = build_doll(adult_with_riders());
  const dynamics::Model model(doll.definition);
  SkeletonPose pose;
  skeleton_pose(doll, dynamics::initial_state(model), pose);
  EXPECT_LT((pose.root_translation - doll.rig.bones[0].rest.translation()).norm(), kPlace);
  for (std::size_t b = 0; b < doll.rig.bones.size(); ++b) {
    const Quaterniond rest(doll.rig.bones[b].rest.linear());
    EXPECT_LT(pose.rotations[b].angularDistance(rest), kAngle) << doll.rig.bones[b].name;
    EXPECT_LT(pose.rest_rotations[b].angularDistance(rest), kAngle) << doll.rig.bones[b].name;
    EXPECT_FALSE(pose.yielding[b]);
  }
}

TEST(SkeletonPose, AnyState_PutsEveryBoneWhereItsBodyCarriesIt) {
  const Doll doll = build_doll(adult_with_riders());
  ASSERT_EQ(doll.definition.bodies.size(), 8U);
  const dynamics::Model model(doll.definition);
  const dynamics::State state = disturbed(model);
  SkeletonPose pose;
  skeleton_pose(doll, state, pose);
  std::vector<dynamics::BodyPose> bodies;
  dynamics::world_poses(model, state, bodies);
  const std::vector<Isometry3d> bones = forward(doll.rig, pose);
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const Carrier& carrier = doll.carriers[b];
    const dynamics::BodyPose& body = bodies[carrier.body];
    const Vector3d place = body.origin + body.rotation * carrier.pose.translation();
    const Quaterniond turn = body.rotation * Quaterniond(carrier.pose.linear());
    EXPECT_LT((bones[b].translation() - place).norm(), kPlace) << doll.rig.bones[b].name;
    EXPECT_LT(Quaterniond(bones[b].linear()).angularDistance(turn), kAngle) << doll.rig.bones[b].name;
    EXPECT_NEAR(pose.rotations[b].norm(), 1.0, 1e-15);
  }
}

TEST(SkeletonPose, TorquesAndYielding_AreThoseOfTheBonesWithBodies) {
  const Doll doll = build_doll(adult_with_riders());
  const dynamics::State state = disturbed(dynamics::Model(doll.definition));
  SkeletonPose pose;
  skeleton_pose(doll, state, pose);
  for (std::size_t bone = 0; bone < doll.rig.bones.size(); ++bone) {
    const int body = doll.body_of_bone[bone];
    if (body < 0) {
      EXPECT_EQ(pose.torques[bone], Vector3d::Zero());
      EXPECT_FALSE(pose.yielding[bone]);
    } else if (doll.definition.bodies[body].parent >= 0) {
      EXPECT_EQ(pose.torques[bone], state.bodies[body].torque);
      EXPECT_EQ(pose.yielding[bone], state.bodies[body].yielding);
      EXPECT_EQ(doll.bone_of_body[body], static_cast<int>(bone));
    }
  }
}

TEST(SkeletonPose, TreeWithoutBody_StaysWhereItIs) {
  character::Rig rig = test::make_prism({.bones = 2});
  Bone control;
  control.name = "control";
  control.rest = control.bind = test::odd_motion();
  rig.bones.push_back(control);
  const Doll doll = build_doll(rig);
  SkeletonPose pose;
  skeleton_pose(doll, disturbed(dynamics::Model(doll.definition)), pose);
  EXPECT_LT(pose.rotations[2].angularDistance(Quaterniond(test::odd_motion().linear())), kAngle);
}

}  // namespace
}  // namespace layfigure::doll
