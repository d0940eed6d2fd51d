#include "polytope.h"

#include <gtest/gtest.h>

#include <set>

#include "fixture.h"

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;

/// Euler's V - E + F, and every edge shared by two faces.
void expect_closed(const Polytope& core) {
  EXPECT_EQ(static_cast<int>(core.vertices.size()) - static_cast<int>(core.edges.size()) +
                static_cast<int>(core.faces.size()),
            2);
  std::size_t sides = 0;
  for (const auto& face : core.faces) sides += face.loop.size();
  EXPECT_EQ(sides, 2 * core.edges.size());
}

void expect_bounds(const Polytope& core, const std::vector<Vector3d>& points) {
  for (const auto& face : core.faces) {
    EXPECT_NEAR(face.normal.norm(), 1.0, 1e-14);
    for (const auto& p : points) EXPECT_LE(face.normal.dot(p), face.offset + 1e-9);
  }
}

TEST(Polytope, BoxWithInnerAndRepeatedPoints_SixQuads) {
  ConvexHull hull = testing::box({0.1, 0.2, 0.3});
  hull.vertices.insert(hull.vertices.end(), {{0.0, 0.0, 0.0}, {0.1, 0.2, 0.3}, {0.1, 0.0, 0.0}, {0.1, 0.2, 0.0}});
  const Polytope core = make_polytope(hull, {});
  EXPECT_EQ(core.vertices.size(), 8U);
  EXPECT_EQ(core.edges.size(), 12U);
  ASSERT_EQ(core.faces.size(), 6U);
  for (const auto& face : core.faces) {
    ASSERT_EQ(face.loop.size(), 4U);
    const Vector3d u = core.vertices[face.loop[1]] - core.vertices[face.loop[0]];
    const Vector3d v = core.vertices[face.loop[2]] - core.vertices[face.loop[1]];
    EXPECT_GT(u.cross(v).dot(face.normal), 0.0) << "counterclockwise seen from outside";
  }
}

TEST(Polytope, RandomClouds_ClosedAndAroundAllPoints) {
  testing::Random random(11);
  for (const int count : {4, 5, 8, 16, 32, 64}) {
    for (int k = 0; k < 5; ++k) {
      const ConvexHull hull{random.cloud(count, 0.1)};
      const Polytope core = make_polytope(hull, {});
      expect_closed(core);
      expect_bounds(core, hull.vertices);
    }
  }
}

TEST(Polytope, Placed_InTheBodysFrame) {
  const Pose X_BS{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX())), {1.0, 2.0, 3.0}};
  const Polytope core = make_polytope(Capsule{0.1, 0.5}, X_BS);
  ASSERT_EQ(core.vertices.size(), 2U);
  EXPECT_LE((core.vertices[1] - Vector3d(1.0, 1.5, 3.0)).norm(), 1e-15);
  EXPECT_LE((core.box_half - Vector3d(0.1, 0.6, 0.1)).norm(), 1e-15);
}

TEST(Polytope, FlatHull_PolygonWithTwoFaces) {
  const Polytope core =
      make_polytope(ConvexHull{{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 1}, {0.5, 0, 1}}}, {});
  EXPECT_EQ(core.vertices.size(), 4U);
  EXPECT_EQ(core.edges.size(), 4U);
  ASSERT_EQ(core.faces.size(), 2U);
  EXPECT_LE((core.faces[0].normal + core.faces[1].normal).norm(), 1e-15);
}

TEST(Polytope, PointsOnALine_ItsEnds) {
  const Polytope core = make_polytope(ConvexHull{{{0, 0, 0}, {2, 2, 2}, {1, 1, 1}, {-1, -1, -1}}}, {});
  EXPECT_EQ(core.vertices.size(), 2U);
  EXPECT_EQ(core.edges.size(), 1U);
  EXPECT_TRUE(core.faces.empty());
  EXPECT_NEAR((core.vertices[0] - core.vertices[1]).norm(), 3.0 * std::sqrt(3.0), 1e-14);
}

TEST(Polytope, OnePointManyTimes_OneVertex) {
  const Polytope core = make_polytope(ConvexHull{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}}, {});
  EXPECT_EQ(core.vertices.size(), 1U);
  EXPECT_EQ(core.edges.size(), 1U);
}

TEST(Polytope, NearlyCoplanarPoints_StayAroundAllPoints) {
  testing::Random random(12);
  for (const double noise : {1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5}) {
    ConvexHull hull;
    for (int i = 0; i < 40; ++i) {
      hull.vertices.emplace_back(random.between(-0.1, 0.1), random.between(-0.1, 0.1), noise * random.between(-1, 1));
    }
    hull.vertices.emplace_back(0.0, 0.0, 0.1);
    const Polytope core = make_polytope(hull, {});
    EXPECT_GE(core.faces.size(), 4U) << noise;
    for (const auto& face : core.faces) {
      for (const auto& p : hull.vertices) EXPECT_LE(face.normal.dot(p), face.offset + 2e-7) << noise;
    }
  }
}

}  // namespace
}  // namespace layfigure::collision
