#include "layfigure/session/mirror.h"

#include <gtest/gtest.h>

#include "layfigure/haptics/hands.h"
#include "small_doll.h"

namespace layfigure::session {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRounding = 1e-12;
const Quaterniond kOddAxes(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()));

/// The trunk with an arm of two bodies on each side, along x; the right arm's bones have odd axes.
doll::Doll two_armed() {
  doll::Doll doll = testing::small_doll();
  const character::Bone bone = doll.rig.bones[0];
  const dynamics::BodyDefinition body = doll.definition.bodies[1];
  doll.rig.bones.clear();
  doll.definition.bodies.clear();
  const std::array<const char*, 5> names{"trunk", "arm.L", "hand.L", "arm.R", "hand.R"};
  const std::array<int, 5> parents{-1, 0, 1, 0, 3};
  const std::array<double, 5> places{0.0, 0.1, 0.3, -0.1, -0.3};
  for (int i = 0; i < 5; ++i) {
    const bool right = i > 2;
    Eigen::Isometry3d bind = Eigen::Isometry3d::Identity();
    bind.translation() = Vector3d(places[i], 0.0, 1.0);
    if (right) bind.linear() = kOddAxes.toRotationMatrix();
    doll.rig.bones.push_back(bone);
    doll.rig.bones.back().name = names[i];
    doll.rig.bones.back().parent = parents[i];
    doll.rig.bones.back().bind = bind;
    Eigen::Isometry3d parent = Eigen::Isometry3d::Identity();
    if (i > 0) parent = doll.rig.bones[parents[i]].bind;
    const Eigen::Isometry3d relative = parent.inverse() * bind;
    doll.rig.bones.back().rest = relative;
    doll.definition.bodies.push_back(body);
    dynamics::BodyDefinition& made = doll.definition.bodies.back();
    made.name = names[i];
    made.parent = parents[i];
    made.anchor = relative.translation();
    made.rotation = made.rest_rotation = Quaterniond(relative.linear());
    made.com = bind.linear().transpose() * Vector3d(i == 0 ? 0.0 : right ? -0.1 : 0.1, 0.0, 0.0);
    made.inertia = Eigen::Matrix3d::Identity() * 1e-3;
  }
  doll.body_of_bone = doll.bone_of_body = {0, 1, 2, 3, 4};
  doll.mirror_of_body = {0, 3, 4, 1, 2};
  doll.carriers.clear();
  for (int i = 0; i < 5; ++i) doll.carriers.push_back({i, Eigen::Isometry3d::Identity()});
  doll.sections.resize(5);
  doll.rig.meshes.clear();
  return doll;
}

class Mirror : public ::testing::Test {
 protected:
  Mirror() {
    haptics::DollMemory memory = hands_.memory();
    for (int i = 0; i < 5; ++i) {
      const Quaterniond turn(Eigen::AngleAxisd(0.3 + 0.1 * i, Vector3d(1.0 + i, -2.0, 3.0 * i).normalized()));
      memory.joints[i].rotation = (memory.joints[i].rotation * turn).normalized();
      memory.joints[i].rest_rotation = (memory.joints[i].rest_rotation * turn * turn).normalized();
      memory.joints[i].flow = i;
    }
    memory.joints[0].position += Vector3d(0.02, 0.03, 0.04);
    hands_.recall(memory);
  }

  [[nodiscard]] std::vector<Vector3d> coms() const {
    std::vector<dynamics::BodyPose> poses;
    dynamics::world_poses(hands_.model(), hands_.state(), poses);
    std::vector<Vector3d> result;
    for (const dynamics::BodyPose& pose : poses) result.push_back(pose.com);
    return result;
  }

  haptics::Hands hands_{two_armed(), 1e-3};
};

TEST_F(Mirror, Both_PutsEachBodyWhereItsImageIs) {
  const std::vector<Vector3d> before = coms();
  hands_.recall(mirrored(hands_.doll(), hands_.memory(), MirrorSide::kBoth));
  const std::vector<Vector3d> after = coms();
  for (int i = 0; i < 5; ++i) {
    Vector3d image = before[hands_.doll().mirror_of_body[i]];
    image.x() = -image.x();
    EXPECT_LT((after[i] - image).norm(), kRounding) << i;
  }
  EXPECT_EQ(hands_.memory().joints[1].flow, 3.0);
}

TEST_F(Mirror, BothTwice_IsThePoseAgain) {
  const haptics::DollMemory before = hands_.memory();
  const haptics::DollMemory once = mirrored(hands_.doll(), before, MirrorSide::kBoth);
  const haptics::DollMemory twice = mirrored(hands_.doll(), once, MirrorSide::kBoth);
  for (int i = 0; i < 5; ++i) {
    EXPECT_GT(once.joints[i].rotation.angularDistance(before.joints[i].rotation), 0.01) << i;
    EXPECT_LT(twice.joints[i].rotation.angularDistance(before.joints[i].rotation), 1e-7) << i;
    EXPECT_LT(twice.joints[i].rest_rotation.angularDistance(before.joints[i].rest_rotation), 1e-7) << i;
  }
}

TEST_F(Mirror, LeftOntoRight_LeavesLeftAndMiddleBitForBit) {
  const haptics::DollMemory before = hands_.memory();
  const haptics::DollMemory both = mirrored(hands_.doll(), before, MirrorSide::kBoth);
  const haptics::DollMemory after = mirrored(hands_.doll(), before, MirrorSide::kLeft);
  for (const int left : {0, 1, 2}) {
    EXPECT_EQ(after.joints[left].rotation.coeffs(), before.joints[left].rotation.coeffs()) << left;
  }
  for (const int right : {3, 4}) {
    EXPECT_EQ(after.joints[right].rotation.coeffs(), both.joints[right].rotation.coeffs()) << right;
  }
  const haptics::DollMemory other = mirrored(hands_.doll(), before, MirrorSide::kRight);
  EXPECT_EQ(other.joints[4].rotation.coeffs(), before.joints[4].rotation.coeffs());
  EXPECT_EQ(other.joints[2].rotation.coeffs(), both.joints[2].rotation.coeffs());
}

TEST_F(Mirror, LockedJoint_StaysAsItIs) {
  hands_.lock({1}, {true, true, true}, true);
  const haptics::DollMemory before = hands_.memory();
  const haptics::DollMemory after = mirrored(hands_.doll(), before, MirrorSide::kBoth);
  EXPECT_EQ(after.joints[1].rotation.coeffs(), before.joints[1].rotation.coeffs());
}

TEST(MirrorOf, DollWithoutPairs_Refused) {
  const haptics::Hands hands(testing::small_doll(), 1e-3);
  EXPECT_THROW((void)mirrored(hands.doll(), hands.memory(), MirrorSide::kBoth), std::invalid_argument);
}

}  // namespace
}  // namespace layfigure::session
