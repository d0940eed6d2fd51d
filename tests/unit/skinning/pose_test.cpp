#include "layfigure/skinning/pose.h"

#include <gtest/gtest.h>

#include <numbers>

#include "fixture.h"
#include "layfigure/dynamics/model.h"
#include "small_doll.h"

namespace layfigure::skinning {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRounding = 1e-14;

TEST(BonePoses, DollAsItStarts_IsTheBindPose) {
  const doll::Doll doll = testing::small_doll();
  const dynamics::Model model(doll.definition);
  doll::SkeletonPose pose;
  doll::skeleton_pose(doll, dynamics::initial_state(model), pose);
  const Skin skin(doll.rig);
  std::vector<Isometry3d> X_WB(skin.bone_count());
  bone_poses(skin, pose, X_WB);
  for (int b = 0; b < skin.bone_count(); ++b) {
    EXPECT_TRUE(X_WB[b].isApprox(skin.bones()[b].bind, kRounding)) << skin.bones()[b].name;
  }
}

TEST(BonePoses, TurnedJoint_MovesWhatHangsOnIt) {
  const Skin skin(testing::small_doll().rig);
  doll::SkeletonPose pose;
  pose.root_translation = {1, 2, 3};
  pose.rotations.assign(4, Quaterniond::Identity());
  pose.rotations[1] = Eigen::AngleAxisd(0.5 * std::numbers::pi, Vector3d::UnitZ());
  std::vector<Isometry3d> X_WB(4);
  bone_poses(skin, pose, X_WB);
  EXPECT_LT((X_WB[0].translation() - Vector3d(1, 2, 3)).norm(), kRounding);
  EXPECT_LT((X_WB[1].translation() - Vector3d(1.2, 2, 3)).norm(), kRounding);
  EXPECT_LT((X_WB[2].translation() - Vector3d(1.2, 2.2, 3)).norm(), kRounding);
  EXPECT_LT((X_WB[3].translation() - Vector3d(1.2, 2.4, 3)).norm(), kRounding);
  EXPECT_LT((X_WB[3].linear() * Vector3d::UnitX() - Vector3d::UnitY()).norm(), kRounding);
}

TEST(BonePoses, SecondRoot_StaysWhereItRests) {
  character::Rig rig = testing::small_doll().rig;
  rig.bones[2].parent = -1;
  rig.bones[2].rest = rig.bones[2].bind;
  const Skin skin(rig);
  doll::SkeletonPose pose;
  pose.root_translation = {1, 2, 3};
  pose.rotations.assign(4, Quaterniond::Identity());
  std::vector<Isometry3d> X_WB(4);
  bone_poses(skin, pose, X_WB);
  EXPECT_TRUE(X_WB[2].isApprox(rig.bones[2].bind, kRounding));
  EXPECT_TRUE(X_WB[3].isApprox(rig.bones[3].bind, kRounding));
}

}  // namespace
}  // namespace layfigure::skinning
