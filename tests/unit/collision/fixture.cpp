#include "fixture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace layfigure::collision::testing {

using Eigen::Vector3d;

// Closed forms agree to the rounding of a few operations on lengths of about a metre.
constexpr double kRounding = 1e-14;

double Random::between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }

Vector3d Random::direction() { return rotation() * Vector3d::UnitX(); }

Eigen::Quaterniond Random::rotation() {
  std::normal_distribution<double> normal;
  const double w = normal(engine_), x = normal(engine_), y = normal(engine_), z = normal(engine_);
  return Eigen::Quaterniond(w, x, y, z).normalized();
}

std::vector<Vector3d> Random::cloud(int count, double size) {
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) points.push_back(size * between(0.7, 1.0) * direction());
  return points;
}

ConvexHull box(const Vector3d& half) {
  ConvexHull hull;
  for (int i = 0; i < 8; ++i) {
    hull.vertices.push_back(half.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  }
  return hull;
}

WorldDefinition pair_of(Shape a, Shape b, double activity) {
  WorldDefinition definition;
  definition.bodies = 2;
  definition.activity = activity;
  definition.shapes = {{.name = "a", .shape = std::move(a), .body = 0},
                       {.name = "b", .shape = std::move(b), .body = 1}};
  return definition;
}

std::vector<ContactPoint> contacts_of(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                                      double activity) {
  World world(pair_of(a, b, activity));
  const std::vector<Pose> poses{X_WA, X_WB};
  EXPECT_EQ(world.update(poses).status, UpdateStatus::kOk);
  expect_consistent(world.contacts());
  return {world.contacts().begin(), world.contacts().end()};
}

WorldDefinition limbs(int count) {
  Random random(7);
  WorldDefinition definition;
  definition.bodies = count;
  for (int i = 0; i < count; ++i) {
    definition.shapes.push_back({.name = "limb", .shape = ConvexHull{random.cloud(32, 0.1)}, .body = i});
    if (i > 0) definition.excluded.emplace_back(i - 1, i);
  }
  return definition;
}

std::vector<Pose> limb_poses(int count, double height) {
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) poses.push_back({.position = Vector3d(0.15 * i, 0.0, height)});
  return poses;
}

double least_gap(std::span<const ContactPoint> contacts) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& contact : contacts) least = std::min(least, contact.gap);
  return least;
}

void expect_consistent(std::span<const ContactPoint> contacts) {
  for (const auto& c : contacts) {
    EXPECT_NEAR(c.normal_W.norm(), 1.0, kRounding);
    const double scale = 1.0 + c.p_Wa.norm();
    EXPECT_LE((c.p_Wa - c.p_Wb - c.gap * c.normal_W).norm(), kRounding * scale) << "points lie along the normal";
  }
}

bool same(std::span<const ContactPoint> a, std::span<const ContactPoint> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const ContactPoint& p, const ContactPoint& q) {
    return p.body_a == q.body_a && p.body_b == q.body_b && p.shape_a == q.shape_a && p.shape_b == q.shape_b &&
           p.p_Wa == q.p_Wa && p.p_Wb == q.p_Wb && p.normal_W == q.normal_W && p.gap == q.gap &&
           p.friction == q.friction && p.feature == q.feature;
  });
}

}  // namespace layfigure::collision::testing
