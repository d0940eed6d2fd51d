#include "triangle_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fixture.h"
#include "tube_rig.h"

namespace layfigure::skinning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kRounding = 1e-14;  // [m]
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A tube whose boxes were fitted to its bind pose, then to another.
struct BentTube {
  Skin skin{testing::tube_rig({.bones = 8})};
  std::vector<Vector3d> positions{skin.bind_positions().begin(), skin.bind_positions().end()};
  TriangleTree tree{skin.triangles(), positions};

  void bend(unsigned seed) {
    positions = test::deformed(skin, test::random_poses(skin, 1.2, seed), Blend::kLinear).positions;
    tree.refit(positions);
  }
  [[nodiscard]] const Vector3d& corner(int triangle, int corner) const {
    return positions[skin.triangles()[triangle][corner]];
  }
  [[nodiscard]] Vector3d middle() const { return 0.5 * (positions.front() + positions.back()); }
};

double closest_by_force(const BentTube& tube, const Vector3d& p) {
  double least = kInfinity;
  for (int t = 0; t < static_cast<int>(tube.skin.triangles().size()); ++t) {
    const auto candidate = closest_on_triangle(p, tube.corner(t, 0), tube.corner(t, 1), tube.corner(t, 2));
    least = std::min(least, (candidate.point - p).norm());
  }
  return least;
}

double cast_by_force(const BentTube& tube, const Ray& ray) {
  double first = kInfinity;
  for (int t = 0; t < static_cast<int>(tube.skin.triangles().size()); ++t) {
    const auto crossing = ray.cross(tube.corner(t, 0), tube.corner(t, 1), tube.corner(t, 2));
    if (crossing) first = std::min(first, crossing->distance);
  }
  return first;
}

TEST(TriangleTree, ClosestInManyPoses_IsThatOfAllTriangles) {
  BentTube tube;
  std::mt19937 generator(31);
  for (unsigned pose = 0; pose < 5; ++pose) {
    for (int i = 0; i < 400; ++i) {
      const Vector3d p = tube.middle() + test::random_vector(generator, i % 2 == 0 ? 0.5 : 3.0);
      const auto closest = tube.tree.closest(tube.positions, p);
      ASSERT_TRUE(closest);
      EXPECT_NEAR(std::sqrt(closest->squared_distance), closest_by_force(tube, p), kRounding);
      const int t = closest->triangle;
      const auto on_it = closest_on_triangle(p, tube.corner(t, 0), tube.corner(t, 1), tube.corner(t, 2));
      EXPECT_EQ(closest->on_triangle.point, on_it.point);
      EXPECT_EQ(closest->on_triangle.barycentric, on_it.barycentric);
    }
    tube.bend(pose);
  }
}

TEST(TriangleTree, ClosestToItsOwnPoints_IsThere) {
  BentTube tube;
  tube.bend(7);
  for (const Vector3d& p : tube.positions) {
    const auto closest = tube.tree.closest(tube.positions, p);
    ASSERT_TRUE(closest);
    EXPECT_EQ(closest->squared_distance, 0.0);
  }
}

TEST(TriangleTree, CastInManyPoses_IsFirstOfAllTriangles) {
  BentTube tube;
  std::mt19937 generator(32);
  int met = 0;
  for (unsigned pose = 0; pose < 5; ++pose) {
    for (int i = 0; i < 400; ++i) {
      const Vector3d origin = tube.middle() + test::random_vector(generator, i % 2 == 0 ? 0.3 : 2.0);
      const Vector3d target = tube.positions[static_cast<std::size_t>(i) % tube.positions.size()];
      const Ray ray(origin, (target + test::random_vector(generator, 0.03) - origin).normalized());
      const auto hit = tube.tree.cast(tube.positions, ray);
      const double expected = cast_by_force(tube, ray);
      ASSERT_EQ(hit.has_value(), std::isfinite(expected)) << i;
      if (!hit) continue;
      ++met;
      EXPECT_EQ(hit->crossing.distance, expected);
    }
    tube.bend(pose);
  }
  EXPECT_GT(met, 1000);
  EXPECT_LT(met, 1950);
}

TEST(TriangleTree, CastAlongAxes_MeetsTheSurfaceFromWithin) {
  const BentTube tube;
  const testing::Tube shape;
  const Vector3d inside(0.001, 0.002, 0.77);
  for (const Vector3d& direction : {Vector3d::UnitX().eval(), Vector3d(-Vector3d::UnitX()), Vector3d::UnitY().eval(),
                                    Vector3d(-Vector3d::UnitY())}) {
    const auto hit = tube.tree.cast(tube.positions, Ray(inside, direction));
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->crossing.distance, shape.radius, 0.1 * shape.radius);
  }
  EXPECT_NEAR(tube.tree.cast(tube.positions, Ray(inside, Vector3d::UnitZ()))->crossing.distance, 1.6 - 0.77, 1e-14);
}

TEST(TriangleTree, NotFinitePoint_FindsNothing) {
  const BentTube tube;
  EXPECT_FALSE(tube.tree.closest(tube.positions, {kNan, 0, 0}));
  EXPECT_FALSE(tube.tree.closest(tube.positions, {0, kInfinity, 0}));
}

TEST(TriangleTree, FewTriangles_AreFound) {
  const std::vector<Vector3d> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 5}};
  const std::vector<Vector3i> none;
  const TriangleTree empty(none, positions);
  EXPECT_FALSE(empty.closest(positions, {0, 0, 0}));
  EXPECT_FALSE(empty.cast(positions, Ray({0, 0, 1}, Vector3d::UnitZ())));
  const std::vector<Vector3i> one{{0, 1, 2}};
  const TriangleTree single(one, positions);
  EXPECT_EQ(single.closest(positions, {0.25, 0.25, 2})->squared_distance, 4.0);
  EXPECT_EQ(single.cast(positions, Ray({0.25, 0.25, 2}, -Vector3d::UnitZ()))->crossing.distance, 2.0);
}

TEST(TriangleTree, TrianglesOfOneCentre_AreHalvedAllTheSame) {
  const std::vector<Vector3d> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Vector3i> triangles(1000, Vector3i(0, 1, 2));
  const TriangleTree tree(triangles, positions);
  EXPECT_EQ(tree.closest(positions, {0.25, 0.25, 2})->squared_distance, 4.0);
}

}  // namespace
}  // namespace layfigure::skinning
