#include "section.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rig_fixture.h"

namespace layfigure::doll {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRounding = 1e-12;

std::vector<Vector2d> rectangle(double width, double height, const Vector2d& corner) {
  return {corner, corner + Vector2d(width, 0), corner + Vector2d(width, height), corner + Vector2d(0, height)};
}

TEST(PlaneFigure, Rectangle_IsAnalytic) {
  const PlaneFigure figure = plane_figure(rectangle(0.3, 0.2, {5, -7}));
  EXPECT_NEAR(figure.area, 0.06, kRounding);
  EXPECT_LT((figure.centroid - Vector2d(5.15, -6.9)).norm(), kRounding);
  EXPECT_NEAR(figure.second_moment(0, 0), 0.2 * std::pow(0.3, 3) / 12, kRounding);
  EXPECT_NEAR(figure.second_moment(1, 1), 0.3 * std::pow(0.2, 3) / 12, kRounding);
  EXPECT_NEAR(figure.second_moment(0, 1), 0.0, kRounding);
  EXPECT_NEAR(figure.outermost, std::hypot(0.15, 0.1), kRounding);
}

TEST(PlaneFigure, Clockwise_IsTheSame) {
  auto polygon = rectangle(0.3, 0.2, {1, 1});
  std::reverse(polygon.begin(), polygon.end());
  const PlaneFigure figure = plane_figure(polygon);
  EXPECT_NEAR(figure.area, 0.06, kRounding);
  EXPECT_NEAR(figure.mean_second_moment(), 0.06 * (0.09 + 0.04) / 24, kRounding);
}

TEST(PlaneFigure, TooFewCornersOrALine_IsNothing) {
  EXPECT_EQ(plane_figure({}).area, 0.0);
  EXPECT_EQ(plane_figure({{0, 0}, {1, 1}}).area, 0.0);
  EXPECT_EQ(plane_figure({{0, 0}, {1, 1}, {2, 2}}).area, 0.0);
}

/// Owners are bones here, as make_surface leaves them.
TEST(CutSurface, PrismAtItsJoint_IsItsPolygon) {
  const test::Prism prism{.sides = 6, .radius = 0.05};
  const Surface surface = make_surface(test::make_prism(prism));
  const auto figure = cut_surface(surface, {{0, 0, 0.3}, Vector3d::UnitZ(), 1});
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, prism.area(), kRounding);
  EXPECT_NEAR(figure->mean_second_moment(), prism.second_moment(), kRounding);
  EXPECT_NEAR(figure->outermost, prism.radius, kRounding);
  EXPECT_LT(figure->centroid.norm(), kRounding);
}

TEST(CutSurface, PrismCutAslant_IsStretchedByTheSlope) {
  const test::Prism prism{.bones = 1, .bone_length = 1.0, .sides = 4};
  const Surface surface = make_surface(test::make_prism(prism));
  const Vector3d normal = Vector3d(1, 0, 1).normalized();
  const auto figure = cut_surface(surface, {{0, 0, 0.47}, normal, 0});
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, prism.area() * std::sqrt(2.0), kRounding);
}

TEST(CutSurface, TwoLimbsInThePlane_TheOneAboutThePointIsTaken) {
  character::Rig rig = test::make_prism({.bones = 1, .radius = 0.05});
  test::add_prism(
      rig, {.prefix = "wide", .bones = 1, .radius = 0.2, .pose = Eigen::Isometry3d(Eigen::Translation3d(1, 0, 0))}, 0);
  for (auto& influences : rig.meshes[1].influences) influences = {{0, 1.0}};  // both weigh upon the same bone
  const Surface surface = make_surface(rig);
  const auto narrow = cut_surface(surface, {{0.01, 0, 0.1}, Vector3d::UnitZ(), 0});
  const auto wide = cut_surface(surface, {{1.1, 0, 0.1}, Vector3d::UnitZ(), 0});
  ASSERT_TRUE(narrow && wide);
  EXPECT_NEAR(narrow->area, 0.005, kRounding);
  EXPECT_NEAR(wide->area, 0.08, kRounding);
}

TEST(CutSurface, WeightFadingAcrossTheSkin_IsClosedByItsChord) {
  character::Rig rig = test::make_prism({.bones = 1, .sides = 64, .radius = 0.1});
  rig.bones.push_back(rig.bones[0]);
  auto& mesh = rig.meshes[0];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    mesh.influences[v] = {{mesh.vertices[v].x() > 0.0 ? 1 : 0, 1.0}};
  }
  const auto half = cut_surface(make_surface(rig), {{0.02, 0, 0.15}, Vector3d::UnitZ(), 1});
  ASSERT_TRUE(half);
  EXPECT_NEAR(half->area, 0.5 * 3.14159 * 0.01, 0.1 * 0.5 * 3.14159 * 0.01);  // to a facet at either end
}

TEST(CutSurface, PlaneBesideTheMesh_IsNothing) {
  const Surface surface = make_surface(test::make_prism({}));
  EXPECT_FALSE(cut_surface(surface, {{0, 0, 5}, Vector3d::UnitZ(), 0}));
}

TEST(CutSurface, OwnerWithoutWeightThere_IsNothing) {
  const Surface surface = make_surface(test::make_prism({.bones = 3}));
  EXPECT_FALSE(cut_surface(surface, {{0, 0, 0.1}, Vector3d::UnitZ(), 2}));
  EXPECT_TRUE(cut_surface(surface, {{0, 0, 0.1}, Vector3d::UnitZ(), 2, 0}));
}

}  // namespace
}  // namespace layfigure::doll
