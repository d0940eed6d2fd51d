#include "closest_point.h"

#include <gtest/gtest.h>

#include <array>

#include "fixture.h"

namespace layfigure::skinning {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

/// The closest point c of a convex set to p is the one for which no point x of the set has (p - c) . (x - c) > 0; of a
/// triangle the corners are enough.
void expect_closest(const Vector3d& p, const Corners& t, double tolerance) {
  const TrianglePoint closest = closest_on_triangle(p, t[0], t[1], t[2]);
  EXPECT_GE(closest.barycentric.minCoeff(), -1e-15);
  EXPECT_NEAR(closest.barycentric.sum(), 1.0, 1e-15);
  const Vector3d combined =
      closest.barycentric[0] * t[0] + closest.barycentric[1] * t[1] + closest.barycentric[2] * t[2];
  EXPECT_LT((closest.point - combined).norm(), 2e-15);
  for (const Vector3d& corner : t) EXPECT_LE((p - closest.point).dot(corner - closest.point), tolerance);
}

TEST(ClosestOnTriangle, RandomTrianglesAndPoints_IsClosest) {
  std::mt19937 generator(11);
  for (int i = 0; i < 20000; ++i) {
    Corners t;
    for (Vector3d& corner : t) corner = test::random_vector(generator, 1.0);
    const Vector3d ab = t[1] - t[0];
    const Vector3d ac = t[2] - t[0];
    const double sine = ab.cross(ac).norm() / (ab.norm() * ac.norm());
    expect_closest(test::random_vector(generator, 2.0), t, 1e-14 / sine);
  }
}

TEST(ClosestOnTriangle, PointInEachRegion_HasExactZerosOfTheFarCorners) {
  const Corners t{Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0)};
  const auto barycentric = [&](double x, double y) {
    return closest_on_triangle({x, y, 0.5}, t[0], t[1], t[2]).barycentric;
  };
  EXPECT_EQ(barycentric(-1, -1), Vector3d(1, 0, 0));
  EXPECT_EQ(barycentric(3, 0.5), Vector3d(0, 1, 0));
  EXPECT_EQ(barycentric(0.5, 3), Vector3d(0, 0, 1));
  EXPECT_EQ(barycentric(0.25, -1), Vector3d(0.75, 0.25, 0));
  EXPECT_EQ(barycentric(-1, 0.25), Vector3d(0.75, 0, 0.25));
  EXPECT_EQ(barycentric(1, 1), Vector3d(0, 0.5, 0.5));
  EXPECT_EQ(barycentric(0.25, 0.5), Vector3d(0.25, 0.25, 0.5));
}

TEST(ClosestOnTriangle, CollapsedTriangle_IsClosestOfItsEdges) {
  const Vector3d a(0.1, 0.2, 0.3);
  const Vector3d b(0.5, -0.2, 0.4);
  std::mt19937 generator(12);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d p = test::random_vector(generator, 1.0);
    for (const Corners& t : {Corners{a, a, a}, Corners{a, a, b}, Corners{a, b, a}, Corners{b, a, a},
                             Corners{a, b, a + 0.25 * (b - a)}, Corners{a, b, a + 3.0 * (b - a)}}) {
      expect_closest(p, t, 1e-14);
    }
  }
}

TEST(ClosestOnTriangle, Sliver_IsClosestWithinItsWidth) {
  std::mt19937 generator(13);
  const Vector3d a(0, 0, 0);
  const Vector3d b(1, 0, 0);
  for (const double width : {1e-6, 1e-7, 1e-9, 1e-12}) {
    for (int i = 0; i < 1000; ++i) expect_closest(test::random_vector(generator, 1.0), {a, b, {0.4, width, 0}}, 2e-8);
  }
}

}  // namespace
}  // namespace layfigure::skinning
