#include "allocation_count.h"

#include <gtest/gtest.h>

#include "fixture.h"
#include "layfigure/skinning/posed_skin.h"
#include "tube_rig.h"

namespace layfigure::skinning {
namespace {

using Eigen::Vector3d;

TEST(PosedSkin, PosesAndQueries_DoNotAllocate) {
  for (const Blend blend : {Blend::kLinear, Blend::kDualQuaternion}) {
    PosedSkin posed(Skin(testing::tube_rig({.bones = 6})), blend);
    const std::vector<Eigen::Isometry3d> X_WB = test::random_poses(posed.skin(), 0.8, 8);
    doll::SkeletonPose pose;
    pose.rotations.assign(6, Eigen::Quaterniond::Identity());
    const long before = testing::allocation_count();
    posed.pose(pose);
    posed.pose(X_WB);
    const auto closest = posed.closest_point(posed.positions()[40] + Vector3d(0.1, 0.2, 0.1));
    const auto hit = posed.cast_ray(posed.positions()[0] * 3.0, posed.positions()[40] - posed.positions()[0] * 3.0);
    const long after = testing::allocation_count();
    EXPECT_EQ(after, before);
    EXPECT_TRUE(closest);
    EXPECT_TRUE(hit);
  }
}

}  // namespace
}  // namespace layfigure::skinning
