#include "mass_properties.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "rig_fixture.h"
#include "solids.h"

namespace layfigure::doll {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kRounding = 1e-12;  // relative: a few hundred additions

using test::Solid;

/// Its first four triangles are two opposite sides.
Solid box(const Vector3d& size) {
  Solid solid;
  for (int corner = 0; corner < 8; ++corner) {
    solid.points.emplace_back((corner & 1) * size.x(), (corner >> 1 & 1) * size.y(), (corner >> 2) * size.z());
  }
  solid.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                     {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return solid;
}

MassProperties measure(const Solid& solid) {
  return mass_properties(solid.triangles, solid.points, Matrix3d::Identity());
}

Vector3d box_inertia(const Vector3d& s, double mass) {
  const Vector3d q = s.cwiseAbs2();
  return mass / 12.0 * Vector3d(q.y() + q.z(), q.z() + q.x(), q.x() + q.y());
}

TEST(MassProperties, Box_IsAnalytic) {
  const Vector3d size(0.2, 0.3, 0.7);
  const MassProperties m = measure(box(size));
  EXPECT_FALSE(m.estimated);
  EXPECT_NEAR(m.volume, size.prod(), kRounding);
  EXPECT_LT((m.com - size / 2).norm(), kRounding);
  EXPECT_LT((m.inertia - Matrix3d(box_inertia(size, size.prod()).asDiagonal())).norm(), kRounding);
}

TEST(MassProperties, BoxFarOutAndTurned_IsTheSameBox) {
  const Vector3d size(0.2, 0.3, 0.7);
  Solid solid = box(size);
  const Eigen::Isometry3d X = Eigen::Translation3d(1e4, -2e4, 5e3) * test::odd_motion();
  for (auto& point : solid.points) point = X * point;
  const MassProperties m = measure(solid);
  // 2e4 m away a double has 4e-12 m left.
  EXPECT_NEAR(m.volume, size.prod(), 1e-10);
  EXPECT_LT((m.com - X * (size / 2)).norm(), 1e-10);
  const Matrix3d expected = X.linear() * box_inertia(size, size.prod()).asDiagonal() * X.linear().transpose();
  EXPECT_LT((m.inertia - expected).norm(), 1e-10);
}

TEST(MassProperties, BoxWithoutLids_IsClosed) {
  const Vector3d size(0.2, 0.3, 0.7);
  Solid solid = box(size);
  solid.triangles.erase(solid.triangles.begin(), solid.triangles.begin() + 4);  // bottom and top
  const MassProperties m = measure(solid);
  EXPECT_FALSE(m.estimated);
  EXPECT_NEAR(m.volume, size.prod(), kRounding);
  EXPECT_LT((m.com - size / 2).norm(), kRounding);
  EXPECT_LT((m.inertia - Matrix3d(box_inertia(size, size.prod()).asDiagonal())).norm(), kRounding);
}

TEST(MassProperties, FlatSheet_IsACapsuleInItsBox) {
  const Solid sheet{{{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const MassProperties m = measure(sheet);
  EXPECT_TRUE(m.estimated);
  const double r = std::sqrt(0.5 * 0.05);  // half as wide as half the sheet's width times the least thickness
  EXPECT_NEAR(m.volume, std::numbers::pi * r * r * (2.0 - 2.0 * r) + 4.0 / 3.0 * std::numbers::pi * r * r * r,
              kRounding);
  EXPECT_LT((m.com - Vector3d(0.5, 1, 0)).norm(), kRounding);
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(m.inertia).eigenvalues();
  EXPECT_GT(moments[0], 0.0);
  EXPECT_NEAR(m.inertia(1, 1), moments[0], kRounding);  // long along y
  EXPECT_NEAR(moments[1], moments[2], kRounding);
}

TEST(MassProperties, CapsuleInsideOut_IsTheCapsuleInItsBox) {
  Solid solid = test::capsule(0.05, 0.4, 64);
  const MassProperties outside = measure(solid);
  for (auto& t : solid.triangles) std::swap(t[0], t[1]);
  const MassProperties inside = measure(solid);
  EXPECT_FALSE(outside.estimated);
  EXPECT_TRUE(inside.estimated);
  EXPECT_NEAR(inside.volume, outside.volume, 0.01 * outside.volume);
  EXPECT_LT((inside.com - outside.com).norm(), kRounding);
  EXPECT_LT((inside.inertia - outside.inertia).norm(), 0.01 * outside.inertia.norm());
}

TEST(MassProperties, PartWithoutSize_StillHasAVolume) {
  const Solid point{{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}}};
  const MassProperties m = measure(point);
  EXPECT_TRUE(m.estimated);
  EXPECT_TRUE(m.com.allFinite());
  EXPECT_TRUE(m.inertia.allFinite());
}

TEST(BoundaryLoops, ClosedBox_HasNone) { EXPECT_TRUE(boundary_loops(box({1, 1, 1}).triangles).empty()); }

TEST(BoundaryLoops, Tube_HasTwoOfFour) {
  Solid solid = box({1, 1, 1});
  solid.triangles.erase(solid.triangles.begin(), solid.triangles.begin() + 4);
  const auto loops = boundary_loops(solid.triangles);
  ASSERT_EQ(loops.size(), 2U);
  EXPECT_EQ(loops[0].size(), 4U);
  EXPECT_EQ(loops[1].size(), 4U);
}

TEST(BoundaryLoops, TwoTrianglesAtOneVertex_LeaveNoEdgeOut) {
  const std::vector<Vector3i> bow_tie{{0, 1, 2}, {0, 3, 4}};
  std::size_t edges = 0;
  for (const auto& loop : boundary_loops(bow_tie)) edges += loop.size();
  EXPECT_EQ(edges, 6U);
}

}  // namespace
}  // namespace layfigure::doll
