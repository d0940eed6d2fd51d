#include "plane_figure.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace layfigure::doll {
namespace {

using Eigen::Vector2d;

constexpr double kRounding = 1e-12;

Polygon rectangle(double width, double height, const Vector2d& corner) {
  return {corner, corner + Vector2d(width, 0), corner + Vector2d(width, height), corner + Vector2d(0, height)};
}

Polygon reversed(Polygon polygon) {
  std::reverse(polygon.begin(), polygon.end());
  return polygon;
}

Polygon turned(Polygon polygon, double angle) {
  for (Vector2d& p : polygon) p = Eigen::Rotation2Dd(angle) * p;
  return polygon;
}

Polygon regular(int sides) {
  Polygon polygon;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / sides;
    polygon.emplace_back(std::cos(angle), std::sin(angle));
  }
  return polygon;
}

TEST(PlaneFigure, Rectangle_IsAnalytic) {
  const PlaneFigure figure = plane_figure({rectangle(0.3, 0.2, {5, -7})});
  EXPECT_NEAR(figure.area, 0.06, kRounding);
  EXPECT_LT((figure.centroid - Vector2d(5.15, -6.9)).norm(), kRounding);
  EXPECT_NEAR(figure.second_moment(0, 0), 0.2 * std::pow(0.3, 3) / 12, kRounding);
  EXPECT_NEAR(figure.second_moment(1, 1), 0.3 * std::pow(0.2, 3) / 12, kRounding);
  EXPECT_NEAR(figure.second_moment(0, 1), 0.0, kRounding);
  EXPECT_NEAR(figure.outermost(), std::hypot(0.15, 0.1), kRounding);
  EXPECT_NEAR(figure.outermost(Vector2d::UnitX()), 0.15, kRounding);
  EXPECT_NEAR(figure.outermost(Vector2d::UnitY()), 0.1, kRounding);
}

TEST(PlaneFigure, Clockwise_IsTheSame) {
  const PlaneFigure figure = plane_figure({reversed(rectangle(0.3, 0.2, {1, 1}))});
  EXPECT_NEAR(figure.area, 0.06, kRounding);
  EXPECT_NEAR(figure.second_moment.trace(), 0.06 * (0.09 + 0.04) / 12, kRounding);
}

TEST(PlaneFigure, HoleAndIslandInIt_AreTakenOutAndPutBack) {
  const Polygon outline = rectangle(4, 4, {-2, -2});
  const Polygon hole = reversed(rectangle(2, 2, {-1, -1}));
  const Polygon island = rectangle(1, 1, {-0.5, -0.5});
  const PlaneFigure figure = plane_figure({outline, hole, island});
  EXPECT_NEAR(figure.area, 16.0 - 4.0 + 1.0, kRounding);
  EXPECT_NEAR(figure.second_moment(0, 0), (256.0 - 16.0 + 1.0) / 12.0, kRounding);
  EXPECT_NEAR(figure.outermost(Vector2d::UnitX()), 2.0, kRounding);
  const PlaneFigure clockwise = plane_figure({reversed(outline), reversed(hole), reversed(island)});
  EXPECT_NEAR(clockwise.area, figure.area, kRounding);
  EXPECT_NEAR(clockwise.second_moment(0, 0), figure.second_moment(0, 0), kRounding);
}

TEST(PlaneFigure, HoleOffCentre_MovesTheCentroid) {
  const PlaneFigure figure = plane_figure({rectangle(4, 4, {0, 0}), reversed(rectangle(1, 1, {2.5, 1.5}))});
  EXPECT_NEAR(figure.centroid.x(), (16.0 * 2.0 - 3.0) / 15.0, kRounding);
  EXPECT_NEAR(figure.centroid.y(), 2.0, kRounding);
}

TEST(PlaneFigure, TooFewCornersOrALineOrOnlyHole_IsNothing) {
  EXPECT_EQ(plane_figure({}).area, 0.0);
  EXPECT_EQ(plane_figure({{}}).area, 0.0);
  EXPECT_EQ(plane_figure({{{0, 0}, {1, 1}}}).area, 0.0);
  EXPECT_EQ(plane_figure({{{0, 0}, {1, 1}, {2, 2}}}).area, 0.0);
  EXPECT_EQ(plane_figure({rectangle(1, 1, {0, 0}), reversed(rectangle(2, 2, {0, 0}))}).area, 0.0);
}

TEST(PlaneFigure, FigureEight_IsNothingOrPositive) {
  // The lobes cancel but for a little; about the far centroid a second moment would be negative.
  const PlaneFigure figure = plane_figure({{{0, 0}, {2, 2}, {2.1, 0}, {0, 2}}});
  EXPECT_GE(figure.area, 0.0);
  EXPECT_TRUE(figure.area == 0.0 || figure.second_moment.determinant() > 0.0);
}

TEST(Contains, PointInsideAndBeside_AreToldApart) {
  const Polygon square = rectangle(2, 2, {0, 0});
  EXPECT_TRUE(contains(square, {1, 1}));
  EXPECT_FALSE(contains(square, {3, 1}));
  EXPECT_FALSE(contains(square, {-1, 1}));
  EXPECT_TRUE(contains(reversed(square), {0.5, 1.5}));
}

TEST(MajorAxis, RectangleTurned_IsAcrossItsLength) {
  for (int k = -8; k <= 8; ++k) {
    const double angle = k * std::numbers::pi / 16;
    const Vector2d axis = major_axis(plane_figure({turned(rectangle(3, 1, {-1.5, -0.5}), angle)}));
    const Vector2d along(std::cos(angle), std::sin(angle));
    EXPECT_NEAR(axis.norm(), 1.0, kRounding) << k;
    EXPECT_NEAR(axis.dot(along), 0.0, kRounding) << k;
  }
}

TEST(MajorAxis, RoundFigure_IsX) {
  for (const int sides : {3, 4, 5, 8, 16}) {
    for (const double angle : {0.0, 0.1, 0.7}) {
      EXPECT_EQ(major_axis(plane_figure({turned(regular(sides), angle)})), Vector2d::UnitX()) << sides;
    }
  }
}

TEST(MajorAxis, NearlyRoundFigure_DoesNotHangOnRounding) {
  Polygon polygon = regular(16);
  for (Vector2d& p : polygon) p.y() *= 1.004;
  EXPECT_EQ(major_axis(plane_figure({polygon})), Vector2d::UnitX());
  for (Vector2d& p : polygon) p.y() *= 1.05;
  EXPECT_GT(major_axis(plane_figure({polygon})).x(), 0.999);  // longest along y: stiffest about x
}

TEST(MajorAxis, RectangleAtFortyFiveDegrees_DoesNotFlipByRounding) {
  for (const double side : {-1.0, 1.0}) {
    const double angle = side * std::numbers::pi / 4;
    const Polygon polygon = rectangle(3, 1, {-1.5, -0.5});
    const Vector2d axis = major_axis(plane_figure({turned(polygon, angle)}));
    for (const double hair : {-1e-9, 1e-9}) {
      EXPECT_LT((major_axis(plane_figure({turned(polygon, angle + hair)})) - axis).norm(), 1e-8) << side;
    }
  }
}

}  // namespace
}  // namespace layfigure::doll
