#include "section.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "rig_fixture.h"
#include "solids.h"

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

constexpr double kRounding = 1e-12;

/// A cut whose axes in its plane do not matter.
Cut across(const Vector3d& normal, const Vector3d& point, int owner, int other = -1) {
  return {point, cut_axes(normal, Eigen::Matrix3d::Identity()), owner, other};
}

/// Owners are bones here, as make_surface leaves them.
TEST(CutSurface, PrismAtItsJoint_IsItsPolygon) {
  const test::Prism prism{.sides = 6, .radius = 0.05};
  const Surface surface = make_surface(test::make_prism(prism));
  const auto figure = cut_surface(surface, across(Vector3d::UnitZ(), {0, 0, 0.3}, 1));
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, prism.area(), kRounding);
  EXPECT_NEAR(figure->second_moment(0, 0), prism.second_moment(), kRounding);
  EXPECT_NEAR(figure->second_moment(1, 1), prism.second_moment(), kRounding);
  EXPECT_NEAR(figure->outermost(), prism.radius, kRounding);
  EXPECT_LT(figure->centroid.norm(), kRounding);
}

TEST(CutSurface, PrismCutAslant_IsStretchedByTheSlope) {
  const test::Prism prism{.bones = 1, .bone_length = 1.0, .sides = 4};
  const Surface surface = make_surface(test::make_prism(prism));
  const Vector3d normal = Vector3d(1, 0, 1).normalized();
  const auto figure = cut_surface(surface, across(normal, {0, 0, 0.47}, 0));
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, prism.area() * std::sqrt(2.0), kRounding);
}

TEST(CutSurface, TwoLimbsInThePlane_TheOneAboutThePointIsTaken) {
  character::Rig rig = test::make_prism({.bones = 1, .radius = 0.05});
  test::add_prism(
      rig, {.prefix = "wide", .bones = 1, .radius = 0.2, .pose = Eigen::Isometry3d(Eigen::Translation3d(1, 0, 0))}, 0);
  for (auto& influences : rig.meshes[1].influences) influences = {{0, 1.0}};  // both weigh upon the same bone
  const Surface surface = make_surface(rig);
  const auto narrow = cut_surface(surface, across(Vector3d::UnitZ(), {0.01, 0, 0.1}, 0));
  const auto wide = cut_surface(surface, across(Vector3d::UnitZ(), {1.1, 0, 0.1}, 0));
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
  const auto half = cut_surface(make_surface(rig), across(Vector3d::UnitZ(), {0.02, 0, 0.15}, 1));
  ASSERT_TRUE(half);
  EXPECT_NEAR(half->area, 0.5 * 3.14159 * 0.01, 0.1 * 0.5 * 3.14159 * 0.01);  // to a facet at either end
}

TEST(CutSurface, PlaneBesideTheMesh_IsNothing) {
  const Surface surface = make_surface(test::make_prism({}));
  EXPECT_FALSE(cut_surface(surface, across(Vector3d::UnitZ(), {0, 0, 5}, 0)));
}

TEST(CutSurface, OwnerWithoutWeightThere_IsNothing) {
  const Surface surface = make_surface(test::make_prism({.bones = 3}));
  EXPECT_FALSE(cut_surface(surface, across(Vector3d::UnitZ(), {0, 0, 0.1}, 2)));
  EXPECT_TRUE(cut_surface(surface, across(Vector3d::UnitZ(), {0, 0, 0.1}, 2, 0)));
}

Surface surface_of(const test::Solid& solid) { return make_surface(test::rig_of(solid, 0.0)); }

/// The upper half of the skin, of the solid's bone 1, cut where the bones meet.
std::optional<PlaneFigure> middle_of(const test::Solid& solid) {
  return cut_surface(surface_of(solid), across(Vector3d::UnitZ(), Vector3d::Zero(), 1));
}

void append(test::Solid& solid, const test::Solid& other, const Vector3d& offset) {
  const int first = static_cast<int>(solid.points.size());
  for (const Vector3d& point : other.points) solid.points.emplace_back(point + offset);
  for (const Eigen::Vector3i& t : other.triangles) solid.triangles.emplace_back(t + Eigen::Vector3i::Constant(first));
}

/// Each triangle with points of its own, a hair beside those of its neighbours.
test::Solid unjoined(const test::Solid& solid) {
  constexpr double kHair = 1e-9;
  test::Solid result;
  for (const Eigen::Vector3i& t : solid.triangles) {
    const int first = static_cast<int>(result.points.size());
    for (const int corner : t) {
      result.points.emplace_back(solid.points[corner] * (1.0 + kHair * static_cast<double>(result.triangles.size())));
    }
    result.triangles.emplace_back(first, first + 1, first + 2);
  }
  return result;
}

const double kArea = std::numbers::pi * 0.05 * 0.05;  // of the cylinders below
constexpr double kFacets = 0.01;                      // what 48 sides leave of a circle

TEST(CutSurface, Tube_HasItsBoreTakenOut) {
  const auto figure = middle_of(test::tube(0.05, 0.04, 0.3, 48));
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, 0.36 * kArea, kFacets * kArea);
  EXPECT_NEAR(figure->outermost(), 0.05, 1e-3 * 0.05);
}

TEST(CutSurface, TubeCutFromWithinItsWall_HasItsBoreTakenOut) {
  const Surface surface = surface_of(test::tube(0.05, 0.04, 0.3, 48));
  const auto figure = cut_surface(surface, across(Vector3d::UnitZ(), {0.045, 0.0, 0.0}, 1));
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, 0.36 * kArea, kFacets * kArea);
}

TEST(CutSurface, RodInATube_CountsBoth) {
  test::Solid solid = test::tube(0.05, 0.04, 0.3, 48);
  append(solid, test::cylinder(0.02, 0.3, 48), Vector3d::Zero());
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, (0.36 + 0.16) * kArea, kFacets * kArea);
}

TEST(CutSurface, SkinUnderSkin_CountsOnce) {
  test::Solid solid = test::cylinder(0.05, 0.3, 48);
  append(solid, test::cylinder(0.04, 0.3, 48), Vector3d::Zero());
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, kArea, kFacets * kArea);
}

TEST(CutSurface, InsideOutTube_IsTheSameTube) {
  test::Solid solid = test::tube(0.05, 0.04, 0.3, 48);
  for (auto& t : solid.triangles) std::swap(t[0], t[1]);
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, 0.36 * kArea, kFacets * kArea);
}

TEST(CutSurface, TwoSidedSkin_CountsOnce) {
  test::Solid solid = test::cylinder(0.05, 0.3, 48);
  const auto front = solid.triangles;
  for (const auto& t : front) solid.triangles.emplace_back(t[1], t[0], t[2]);
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, kArea, kFacets * kArea);
}

TEST(CutSurface, SlitSkin_IsClosedByChords) {
  test::Solid solid = test::cylinder(0.05, 0.3, 48);
  std::erase_if(solid.triangles, [&](const Eigen::Vector3i& t) {  // a slit on either side
    const Vector3d middle = (solid.points[t[0]] + solid.points[t[1]] + solid.points[t[2]]) / 3.0;
    return std::abs(middle.y()) < 0.01;
  });
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  EXPECT_LT(figure->area, kArea);
  EXPECT_GT(figure->area, 0.98 * kArea);  // less the two segments, 12 degrees to either side
}

TEST(CutSurface, SkinOfUnjoinedTriangles_IsJoinedByTheShortestGaps) {
  const auto figure = middle_of(unjoined(test::cylinder(0.05, 0.3, 24)));
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, kArea, 4 * kFacets * kArea);
  EXPECT_NEAR(figure->outermost(), 0.05, 1e-3);
}

TEST(CutSurface, SoupOfTriangles_IsNothing) {
  EXPECT_FALSE(middle_of(unjoined(test::cylinder(0.05, 0.3, 400))));  // more pieces than are joined
}

TEST(CutSurface, FinOnTheSkin_HardlyCounts) {
  test::Solid solid = test::cylinder(0.05, 0.3, 48);
  const int first = static_cast<int>(solid.points.size());
  solid.points.emplace_back(0.01, 0.0, -0.15);
  solid.points.emplace_back(0.01, 0.0, 0.15);
  int low = -1;
  int high = -1;
  for (int k = 0; k < first; ++k) {  // the line along the skin at y = 0
    if (solid.points[k] == Vector3d(0.05, 0.0, -0.15)) low = k;
    if (solid.points[k] == Vector3d(0.05, 0.0, 0.15)) high = k;
  }
  ASSERT_TRUE(low >= 0 && high >= 0);
  solid.triangles.emplace_back(low, high, first);
  solid.triangles.emplace_back(high, first + 1, first);
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  EXPECT_NEAR(figure->area, kArea, 2 * kFacets * kArea);
}

TEST(CutSurface, TwoLimbsThatOverlap_ArePlausible) {
  test::Solid solid = test::cylinder(0.05, 0.3, 48);
  append(solid, test::cylinder(0.05, 0.3, 48), {0.03, 0.001, 0.0});
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  EXPECT_GT(figure->area, 0.98 * kArea);
  EXPECT_LT(figure->area, 2.0 * kArea);
}

TEST(CutAxes, BoneAlongItsY_HasYOfTheSectionOnItsZ) {
  const Eigen::Matrix3d bone = test::odd_motion().linear();
  const Eigen::Matrix3d axes = cut_axes(bone.col(1), bone);
  EXPECT_LT((axes.col(0) - bone.col(1)).norm(), kRounding);
  EXPECT_LT((axes.col(1) - bone.col(2)).norm(), kRounding);
  EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), kRounding);
  EXPECT_NEAR(axes.determinant(), 1.0, kRounding);
}

TEST(CutAxes, NormalMidwayBetweenTwoAxes_DoesNotHangOnRounding) {
  const Eigen::Matrix3d bone = Eigen::Matrix3d::Identity();
  const Vector3d midway = Vector3d(1, 1, 0).normalized();
  const Eigen::Matrix3d axes = cut_axes(midway, bone);
  for (const double hair : {-1e-9, 1e-9}) {
    const Vector3d beside = (midway + Vector3d(hair, -hair, hair)).normalized();
    EXPECT_LT((cut_axes(beside, bone) - axes).norm(), 1e-8);
  }
}

TEST(PrincipalSection, EllipseAslant_HasItsOwnAxes) {
  const double turn = 0.3;  // [rad] from the bone's x to the ellipse's long axis
  test::Solid solid = test::stretched(test::cylinder(1.0, 0.3, 96), {0.06, 0.02, 1.0});
  for (Vector3d& point : solid.points) point = Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * point;
  const auto figure = middle_of(solid);
  ASSERT_TRUE(figure);
  const Eigen::Matrix3d axes = cut_axes(Vector3d::UnitZ(), Eigen::Matrix3d::Identity());
  const Section section = principal_section(*figure, Eigen::Isometry3d(axes));
  const Vector3d long_axis(std::cos(turn), std::sin(turn), 0.0);
  const Eigen::Matrix3d R = section.axes.toRotationMatrix();
  EXPECT_LT((R.col(0) - Vector3d::UnitZ()).norm(), kRounding);
  EXPECT_NEAR(std::abs(R.col(2).dot(long_axis)), 1.0, kRounding);  // stiffest about the short axis, y
  EXPECT_GT(section.second_moments.y(), 8.5 * section.second_moments.z());
  EXPECT_DOUBLE_EQ(section.second_moments.x(), section.second_moments.y() + section.second_moments.z());
  EXPECT_NEAR(section.outermost.x(), 0.06, kRounding);
  EXPECT_NEAR(section.outermost.y(), 0.06, kRounding);
  EXPECT_NEAR(section.outermost.z(), 0.02, kRounding);
  ASSERT_EQ(section.outline.size(), figure->outline.size());
  for (const Vector3d& corner : section.outline) EXPECT_NEAR(corner.z(), 0.0, kRounding);
}

}  // namespace
}  // namespace layfigure::doll
