#include "contact_shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "layfigure/doll/build.h"
#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> sphere_points(int count, double radius) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<Vector3d> points;
  for (int k = 0; k < count; ++k) {
    points.push_back(radius * Vector3d(normal(random), normal(random), normal(random)).normalized());
  }
  return points;
}

std::vector<Vector3d> grid_points(const Vector3d& half, int count) {
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      for (int k = 0; k < count; ++k) {
        points.push_back(half.cwiseProduct(2.0 / (count - 1) * Vector3d(i, j, k) - Vector3d::Ones()));
      }
    }
  }
  return points;
}

double support(const std::vector<Vector3d>& points, const Vector3d& n) {
  double most = -INFINITY;
  for (const Vector3d& p : points) most = std::max(most, n.dot(p));
  return most;
}

std::vector<Vector3d> chosen(const std::vector<Vector3d>& points, const std::vector<int>& indices) {
  std::vector<Vector3d> result;
  for (const int index : indices) result.push_back(points[index]);
  return result;
}

TEST(HullPoints, Box_ItsCornersAlone) {
  const std::vector<Vector3d> points = grid_points({0.1, 0.2, 0.3}, 5);
  const std::vector<int> indices = hull_points(points, 1e-9, 32);
  EXPECT_EQ(indices.size(), 8U);
  for (const int index : indices) EXPECT_NEAR(points[index].norm(), Vector3d(0.1, 0.2, 0.3).norm(), 1e-12);
}

TEST(HullPoints, Sphere_NoneMissedByMoreThanTheTolerance) {
  constexpr double kRadius = 0.2;
  constexpr double kTolerance = 0.03;
  const std::vector<Vector3d> points = sphere_points(2000, kRadius);
  const std::vector<Vector3d> hull = chosen(points, hull_points(points, kTolerance, 200));
  EXPECT_LT(hull.size(), 60U);
  // Between the directions that were looked at, 8 degrees apart, little more is missed.
  constexpr double kBetween = kRadius * 4.0 * M_PI / 180.0;
  for (const Vector3d& n : sphere_points(500, 1.0)) {
    EXPECT_LT(support(points, n) - support(hull, n), kTolerance + 0.5 * kBetween);
  }
}

TEST(HullPoints, FewAllowed_TheFarthestOut) {
  const std::vector<Vector3d> points = sphere_points(2000, 1.0);
  EXPECT_EQ(hull_points(points, 0.0, 12).size(), 12U);
  EXPECT_EQ(hull_points({Vector3d::UnitX()}, 0.0, 12).size(), 1U);
}

TEST(HullPoints, FlatAndStraightSets_TheirCorners) {
  EXPECT_EQ(hull_points(grid_points({0.1, 0.2, 0.0}, 4), 1e-9, 32).size(), 4U);
  EXPECT_EQ(hull_points(grid_points({0.0, 0.2, 0.0}, 4), 1e-9, 32).size(), 2U);
}

TEST(MakeCapsule, Cylinder_AsThickAndAsLong) {
  constexpr double kRadius = 0.04;
  constexpr double kHalf = 0.15;
  const Vector3d along = Vector3d(1.0, 2.0, -0.5).normalized();
  dynamics::BodyDefinition body;
  body.mass = 0.7;
  body.com = {0.0, 0.1, 0.0};
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), along);
  const double across = body.mass * (3.0 * kRadius * kRadius + 4.0 * kHalf * kHalf) / 12.0;
  body.inertia = turn * Vector3d(across, across, 0.5 * body.mass * kRadius * kRadius).asDiagonal() *
                 turn.conjugate().toRotationMatrix();
  const auto shape = make_capsule({body.com - kHalf * along, body.com + kHalf * along}, body);
  const auto& capsule = std::get<collision::Capsule>(shape.shape);
  EXPECT_NEAR(capsule.radius, kRadius, 1e-12);
  EXPECT_NEAR(capsule.half_length, kHalf - kRadius, 1e-12);
  EXPECT_NEAR(std::abs((shape.X_BS.rotation * Vector3d::UnitZ()).dot(along)), 1.0, 1e-12);
  EXPECT_LT((shape.X_BS.position - body.com).norm(), 1e-12);
}

TEST(MakeCapsule, ThickerThanLong_ABall) {
  dynamics::BodyDefinition body;
  body.inertia = 0.4 * Eigen::Matrix3d::Identity();  // a ball of 1 m and 1 kg
  const auto shape = make_capsule({Vector3d(0.0, 0.0, 0.1), Vector3d(0.0, 0.0, -0.1)}, body);
  EXPECT_EQ(std::get<collision::Capsule>(shape.shape).half_length, 0.0);
}

/// Three boxes of 10 cm in a row, `distance` apart, the second hanging on the first and the third on the second.
struct Row {
  dynamics::ModelDefinition definition;
  std::vector<collision::ShapeDefinition> shapes;
};

Row row_of_boxes(double distance) {
  Row row;
  for (int k = 0; k < 3; ++k) {
    dynamics::BodyDefinition body;
    body.name = "box" + std::to_string(k);
    body.parent = k - 1;
    body.anchor = {k == 0 ? 0.0 : distance, 0.0, 0.0};
    row.definition.bodies.push_back(body);
    collision::ShapeDefinition shape = make_hull(grid_points(Vector3d::Constant(0.05), 2));
    shape.body = k;
    row.shapes.push_back(shape);
  }
  return row;
}

TEST(OverlappingAtRest, BodiesThatShareSpace_NeverTouch) {
  const Row near = row_of_boxes(0.04);
  EXPECT_EQ(overlapping_at_rest(near.definition, near.shapes), (std::vector<std::pair<int, int>>{{0, 2}}));
  const Row apart = row_of_boxes(0.06);
  EXPECT_TRUE(overlapping_at_rest(apart.definition, apart.shapes).empty());
}

TEST(BuildDoll, Adult_AHullForEachBodyThatHoldsItsSkin) {
  const Doll doll = build_doll(test::make_adult());
  ASSERT_EQ(doll.shapes.size(), doll.definition.bodies.size());
  for (std::size_t b = 0; b < doll.shapes.size(); ++b) {
    EXPECT_EQ(doll.shapes[b].body, static_cast<int>(b));
    EXPECT_EQ(doll.shapes[b].name, doll.definition.bodies[b].name);
    const auto& hull = std::get<collision::ConvexHull>(doll.shapes[b].shape);
    EXPECT_GE(hull.vertices.size(), 8U);
    // The com is inside: nowhere is the hull's side of it empty.
    for (const Vector3d& n : sphere_points(50, 1.0)) {
      EXPECT_GT(support(hull.vertices, n), n.dot(doll.definition.bodies[b].com));
    }
  }
}

}  // namespace
}  // namespace layfigure::doll
