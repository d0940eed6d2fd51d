#include "ray.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fixture.h"
#include "tube_rig.h"

namespace layfigure::skinning {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Ray, AcrossATriangle_MeetsItWhereItAims) {
  std::mt19937 generator(21);
  for (int i = 0; i < 10000; ++i) {
    const Vector3d a = test::random_vector(generator, 1.0);
    const Vector3d b = test::random_vector(generator, 1.0);
    const Vector3d c = test::random_vector(generator, 1.0);
    const Vector3d weights = test::random_vector(generator, 0.45) + Vector3d::Constant(0.5);
    const Vector3d barycentric = weights / weights.sum();
    const Vector3d target = barycentric[0] * a + barycentric[1] * b + barycentric[2] * c;
    const Vector3d origin = test::random_vector(generator, 3.0);
    const double distance = (target - origin).norm();
    const double steepness = std::abs((b - a).cross(c - a).dot(target - origin)) / distance;
    if (steepness < 1e-3) continue;  // nearly edge on: the target is not well defined
    const auto crossing = Ray(origin, (target - origin) / distance).cross(a, b, c);
    ASSERT_TRUE(crossing) << i;
    EXPECT_NEAR(crossing->distance, distance, 1e-11);
    EXPECT_LT((crossing->barycentric - barycentric).norm(), 1e-11);
  }
}

TEST(Ray, PastBehindOrEdgeOn_MeetsNothing) {
  const Vector3d a(0, 0, 1);
  const Vector3d b(1, 0, 1);
  const Vector3d c(0, 1, 1);
  EXPECT_FALSE(Ray({0.6, 0.6, 0}, Vector3d::UnitZ()).cross(a, b, c));
  EXPECT_FALSE(Ray({0.2, 0.2, 2}, Vector3d::UnitZ()).cross(a, b, c));
  EXPECT_FALSE(Ray({-1, 0.2, 1}, Vector3d::UnitX()).cross(a, b, c));
  EXPECT_FALSE(Ray({0.2, 0.2, 0}, Vector3d::UnitZ()).cross(a, a, c));  // collapsed
  EXPECT_TRUE(Ray({0.2, 0.2, 0}, Vector3d::UnitZ()).cross(a, b, c));
  EXPECT_TRUE(Ray({0.2, 0.2, 0}, Vector3d::UnitZ()).cross(a, c, b));  // from behind
  EXPECT_TRUE(Ray({0.2, 0.2, 1}, Vector3d::UnitZ()).cross(a, b, c));  // from on it
}

TEST(Ray, AtEdgesAndCornersOfAClosedMesh_SlipsThroughNowhere) {
  const character::Rig rig = testing::tube_rig({});
  const character::SkinnedMesh& mesh = rig.meshes.front();
  std::mt19937 generator(22);
  const Vector3d inside(0.001, 0.002, 0.3);
  const auto is_met = [&](const Vector3d& target) {
    const Ray ray(inside, (target - inside).normalized());
    for (const Eigen::Vector3i& t : mesh.triangles) {
      if (ray.cross(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) return true;
    }
    return false;
  };
  std::uniform_real_distribution<double> fraction(0.0, 1.0);
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int corner = 0; corner < 3; ++corner) {
      const Vector3d& from = mesh.vertices[t[corner]];
      const Vector3d& to = mesh.vertices[t[(corner + 1) % 3]];
      EXPECT_TRUE(is_met(from));
      for (int i = 0; i < 10; ++i) EXPECT_TRUE(is_met(from + fraction(generator) * (to - from)));
    }
  }
}

TEST(Ray, Box_IsEnteredWhereItsSideIs) {
  const Vector3d low(1, -1, -1);
  const Vector3d high(2, 1, 1);
  EXPECT_EQ(Ray({0, 0, 0}, Vector3d::UnitX()).enter(low, high), 1.0);
  EXPECT_EQ(Ray({3, 0, 0}, -Vector3d::UnitX()).enter(low, high), 1.0);
  EXPECT_EQ(Ray({1.5, 0, 0}, Vector3d::UnitX()).enter(low, high), 0.0);
  EXPECT_EQ(Ray({3, 0, 0}, Vector3d::UnitX()).enter(low, high), kInfinity);
  EXPECT_EQ(Ray({0, 2, 0}, Vector3d::UnitX()).enter(low, high), kInfinity);
  EXPECT_EQ(Ray({0, 1, 1}, Vector3d::UnitX()).enter(low, high), 1.0);  // along an edge
  EXPECT_EQ(Ray({1, 0, 0}, Vector3d::UnitY()).enter(low, high), 0.0);  // within a side
  EXPECT_EQ(Ray({0, -1, 1}, Vector3d(1, -0.0, -0.0)).enter(low, high), 1.0);
  EXPECT_EQ(Ray({0, 2, 0}, Vector3d(1, -0.0, 0)).enter(low, high), kInfinity);
  EXPECT_EQ(Ray({0, 1, 0}, Vector3d::UnitX()).enter({1, 1, -1}, {2, 1, 1}), 1.0);  // a flat box
}

}  // namespace
}  // namespace layfigure::skinning
