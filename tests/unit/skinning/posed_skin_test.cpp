#include "layfigure/skinning/posed_skin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "fixture.h"
#include "small_doll.h"
#include "tube_rig.h"

namespace layfigure::skinning {
namespace {

using character::Rig;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kRounding = 1e-14;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// How often the closed surface goes round p: 1 inside, 0 outside (van Oosterom & Strackee 1983: the solid angles of
/// the triangles).
double winding_number(const PosedSkin& posed, const Vector3d& p) {
  double solid_angles = 0.0;
  for (const Eigen::Vector3i& t : posed.skin().triangles()) {
    const Vector3d a = (posed.positions()[t[0]] - p).normalized();
    const Vector3d b = (posed.positions()[t[1]] - p).normalized();
    const Vector3d c = (posed.positions()[t[2]] - p).normalized();
    solid_angles += 2.0 * std::atan2(a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
  }
  return solid_angles / (4.0 * std::numbers::pi);
}

TEST(PosedSkin, AtFirst_IsInTheBindPose) {
  const PosedSkin posed{Skin(testing::tube_rig({}))};
  const auto bind = posed.skin().bind_positions();
  EXPECT_TRUE(std::equal(bind.begin(), bind.end(), posed.positions().begin(), posed.positions().end()));
  EXPECT_EQ(posed.bone_poses()[2].matrix(), posed.skin().bones()[2].bind.matrix());
}

TEST(PosedSkin, PoseOfTheSkeleton_IsThatOfItsBones) {
  PosedSkin posed(Skin(testing::small_doll().rig), Blend::kDualQuaternion);
  doll::SkeletonPose pose;
  pose.root_translation = {1, 2, 3};
  pose.rotations.assign(4, Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized())));
  posed.pose(pose);
  const std::vector<Vector3d> positions(posed.positions().begin(), posed.positions().end());
  const std::vector<Isometry3d> X_WB(posed.bone_poses().begin(), posed.bone_poses().end());
  EXPECT_EQ(positions, test::deformed(posed.skin(), X_WB, Blend::kDualQuaternion).positions);
  EXPECT_LT((X_WB[0].translation() - Vector3d(1, 2, 3)).norm(), kRounding);
  EXPECT_FALSE(positions[0].isApprox(posed.skin().bind_positions()[0], 1e-3));
}

TEST(PosedSkin, ClosestPoint_DescribesOnePoint) {
  PosedSkin posed{Skin(testing::tube_rig({.bones = 6}))};
  posed.pose(test::random_poses(posed.skin(), 0.8, 5));
  std::mt19937 generator(41);
  for (int i = 0; i < 500; ++i) {
    const Vector3d p = posed.positions()[300] + test::random_vector(generator, 0.4);
    const auto point = posed.closest_point(p);
    ASSERT_TRUE(point);
    const Eigen::Vector3i& t = posed.skin().triangles()[point->triangle];
    Vector3d combined = Vector3d::Zero();
    std::vector<double> weights(posed.skin().bone_count(), 0.0);
    for (int c = 0; c < 3; ++c) {
      combined += point->barycentric[c] * posed.positions()[t[c]];
      for (const auto& [bone, weight] : posed.skin().influences(t[c])) weights[bone] += point->barycentric[c] * weight;
    }
    EXPECT_LT((point->p_WS - combined).norm(), kRounding);
    EXPECT_NEAR(point->distance, (p - point->p_WS).norm(), kRounding);
    EXPECT_NEAR(point->normal_W.norm(), 1.0, kRounding);
    EXPECT_GE(weights[point->bone], *std::max_element(weights.begin(), weights.end()) - kRounding);
    EXPECT_LT((posed.bone_poses()[point->bone] * point->p_BS - point->p_WS).norm(), kRounding);
  }
}

TEST(PosedSkin, SideOfPointsNearABentTube_IsThatByTheWindingNumber) {
  PosedSkin posed(Skin(testing::tube_rig({.bones = 4})), Blend::kDualQuaternion);
  std::vector<Isometry3d> X_WB = test::bind_poses(posed.skin());
  for (int b = 1; b < 4; ++b) {  // an arc that stays clear of itself
    const Isometry3d bind_PB = posed.skin().bones()[b - 1].bind.inverse() * posed.skin().bones()[b].bind;
    X_WB[b] = X_WB[b - 1] * bind_PB * Eigen::AngleAxisd(0.35, Vector3d(0.6, 0.8, 0));
  }
  posed.pose(X_WB);
  std::mt19937 generator(42);
  std::uniform_real_distribution<double> reach(0.0, 0.08);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d near = posed.positions()[static_cast<std::size_t>(i) % posed.positions().size()];
    const Vector3d p = near + reach(generator) * test::random_vector(generator, 1.0);
    const auto point = posed.closest_point(p);
    ASSERT_TRUE(point);
    const double winding = winding_number(posed, p);
    ASSERT_LT(std::min(std::abs(winding), std::abs(winding - 1.0)), 1e-9);
    EXPECT_EQ(point->side, winding > 0.5 ? Side::kInside : Side::kOutside) << i;
    inside += winding > 0.5;
  }
  EXPECT_GT(inside, 300);
  EXPECT_LT(inside, 1700);
}

TEST(PosedSkin, NormalsOnACube_AreThoseOfFaceEdgeAndCorner) {
  PosedSkin posed{Skin(test::cube_rig())};
  const Isometry3d motion = test::odd_motion();
  posed.pose(std::vector{motion});
  for (const Vector3d& outwards : {Vector3d(0, 0, 1), Vector3d(-1, 0, 0), Vector3d(1, 1, 0), Vector3d(0, -1, 1),
                                   Vector3d(1, 1, 1), Vector3d(-1, 1, -1)}) {
    const Vector3d off_middle = outwards.array().abs() * 2.0 * outwards.array() + (1.0 - outwards.array().abs()) * 0.3;
    const auto point = posed.closest_point(motion * off_middle);
    ASSERT_TRUE(point);
    EXPECT_LT((point->normal_W - motion.linear() * outwards.normalized()).norm(), kRounding) << outwards.transpose();
    EXPECT_EQ(point->side, Side::kOutside);
    EXPECT_NEAR(point->distance, outwards.norm(), kRounding);
  }
  const auto inside = posed.closest_point(motion * Vector3d(0.9, 0.3, 0.2));
  ASSERT_TRUE(inside);
  EXPECT_EQ(inside->side, Side::kInside);
  EXPECT_NEAR(inside->distance, 0.1, kRounding);
}

TEST(PosedSkin, OpenMesh_HasNoSides) {
  const PosedSkin posed{Skin(testing::small_doll().rig)};
  const auto point = posed.closest_point({0.3, 0, 1.2});
  ASSERT_TRUE(point);
  EXPECT_EQ(point->side, Side::kOpen);
  EXPECT_NEAR(point->distance, 0.2, kRounding);
  const auto hit = posed.cast_ray({0.31, 0.001, 1.2}, {0, 0, -1});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->side, Side::kOpen);
}

TEST(PosedSkin, Ray_MeetsTheNearSideFromOutsideAndInside) {
  PosedSkin posed{Skin(test::cube_rig())};
  const Isometry3d motion = test::odd_motion();
  posed.pose(std::vector{motion});
  const auto from_outside = posed.cast_ray(motion * Vector3d(3, 0.2, 0.1), motion.linear() * Vector3d(-10, 0, 0));
  ASSERT_TRUE(from_outside);
  EXPECT_NEAR(from_outside->distance, 2.0, kRounding);
  EXPECT_EQ(from_outside->side, Side::kOutside);
  EXPECT_LT((from_outside->p_BS - Vector3d(1, 0.2, 0.1)).norm(), kRounding);
  EXPECT_LT((from_outside->normal_W - motion.linear() * Vector3d::UnitX()).norm(), kRounding);
  const auto from_inside = posed.cast_ray(motion * Vector3d(0, 0.2, 0.1), motion.linear() * Vector3d(-0.01, 0, 0));
  ASSERT_TRUE(from_inside);
  EXPECT_NEAR(from_inside->distance, 1.0, kRounding);
  EXPECT_EQ(from_inside->side, Side::kInside);
  EXPECT_LT((from_inside->normal_W + motion.linear() * Vector3d::UnitX()).norm(), kRounding);
  EXPECT_FALSE(posed.cast_ray(motion * Vector3d(3, 0.2, 0.1), motion.linear() * Vector3d(1, 0, 0)));
}

TEST(PosedSkin, BadInput_FindsNothing) {
  const PosedSkin posed{Skin(test::cube_rig())};
  EXPECT_FALSE(posed.closest_point({0, 0, kNan}));
  EXPECT_FALSE(posed.cast_ray({0, kNan, 0}, {1, 0, 0}));
  EXPECT_FALSE(posed.cast_ray({0, 0, 0}, {1, kNan, 0}));
  EXPECT_FALSE(posed.cast_ray({0, 0, 0}, {0, 0, 0}));
  EXPECT_TRUE(posed.cast_ray({0, 0.1, 0.2}, {1e-200, 0, 0}));
}

TEST(PosedSkin, WithoutTriangles_FindsNothing) {
  Rig rig = test::cube_rig();
  rig.meshes.clear();
  PosedSkin posed{Skin(rig)};
  posed.pose(std::vector{test::odd_motion()});
  EXPECT_FALSE(posed.closest_point({0, 0, 0}));
  EXPECT_FALSE(posed.cast_ray({0, 0, 0}, {1, 0, 0}));
}

TEST(PosedSkin, GrabPoint_IsWhereTheSkinIsTouched) {
  PosedSkin posed{Skin(testing::tube_rig({}))};
  posed.pose(test::random_poses(posed.skin(), 0.5, 6));
  const auto touched = posed.closest_point(posed.positions()[50] + Vector3d(0.01, 0.02, 0.03));
  ASSERT_TRUE(touched);
  const GrabPoint by_default = posed.grab_point(*touched);
  EXPECT_EQ(by_default.bone, touched->bone);
  for (const GrabPoint& grab : {by_default, posed.grab_point(*touched, 0), posed.grab_point(*touched, 2)}) {
    EXPECT_LT((posed.bone_poses()[grab.bone] * grab.point - touched->p_WS).norm(), kRounding) << grab.bone;
  }
  EXPECT_EQ(posed.grab_point(*touched, 2).bone, 2);
}

TEST(PosedSkin, GrabPointOfABoneThatThereIsNot_IsRefused) {
  const PosedSkin posed{Skin(testing::tube_rig({}))};
  for (const int bone : {-1, 3}) {
    try {
      static_cast<void>(posed.grab_point({}, bone));
      FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), ::testing::StartsWith("bone " + std::to_string(bone)));
      EXPECT_THAT(error.what(), ::testing::HasSubstr("0 to 2"));
    }
  }
}

TEST(PosedSkin, Moved_KeepsItsSkinAndPose) {
  PosedSkin first{Skin(test::cube_rig())};
  first.pose(std::vector{test::odd_motion()});
  const PosedSkin second = std::move(first);
  EXPECT_EQ(second.skin().vertex_count(), 8);
  EXPECT_LT((second.positions()[7] - test::odd_motion() * Vector3d(1, 1, 1)).norm(), kRounding);
}

}  // namespace
}  // namespace layfigure::skinning
