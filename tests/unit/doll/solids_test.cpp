#include "solids.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <ostream>

#include "layfigure/doll/build.h"
#include "mass_properties.h"
#include "rig_fixture.h"

// What is measured of a mesh against what its solid has by closed formulas.
namespace layfigure::doll {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kTolerance = 0.01;
constexpr int kSides = 48;  // makes about 1000 triangles of each

struct Analytic {
  double volume;
  Vector3d inertia;  // about x, y, z through the com, density 1
  double area;       // of the section across z through the com
  double about_x;    // second moments of it
  double about_y;
  Vector3d outermost;  // from the centroid, from the axis of the larger second moment, from the other
};

Analytic make_analytic_cylinder(double a, double b, double length) {
  const double area = kPi * a * b;
  const double volume = area * length;
  const double x2 = volume * a * a / 4;
  const double y2 = volume * b * b / 4;
  const double z2 = volume * length * length / 12;
  return {volume, {y2 + z2, z2 + x2, x2 + y2}, area, area * b * b / 4, area * a * a / 4, {a, a, b}};
}

Analytic make_analytic_tube(double outer, double inner, double length) {
  const Analytic full = make_analytic_cylinder(outer, outer, length);
  const Analytic bore = make_analytic_cylinder(inner, inner, length);
  return {full.volume - bore.volume,   full.inertia - bore.inertia, full.area - bore.area,
          full.about_x - bore.about_x, full.about_y - bore.about_y, full.outermost};
}

Analytic make_analytic_capsule(double r, double length) {
  const Analytic cylinder = make_analytic_cylinder(r, r, length);
  const double ball = 4.0 / 3.0 * kPi * r * r * r;
  // A hemisphere of mass m has 2/5 m r^2 about its centre; that is 3/8 r from its com.
  const double to_com = length / 2 + 3.0 / 8.0 * r;
  const double across = ball * (0.4 * r * r - 9.0 / 64.0 * r * r + to_com * to_com);
  Analytic result = cylinder;
  result.volume += ball;
  result.inertia += Vector3d(across, across, 0.4 * ball * r * r);
  return result;
}

Analytic make_analytic_box(const Vector3d& s) {
  const double volume = s.prod();
  const Vector3d q = s.cwiseAbs2() / 12.0;
  const double area = s.x() * s.y();
  return {volume,       volume * Vector3d(q.y() + q.z(), q.z() + q.x(), q.x() + q.y()),
          area,         area * q.y(),
          area * q.x(), {std::hypot(s.x(), s.y()) / 2, s.x() / 2, s.y() / 2}};
}

struct Case {
  const char* name;
  std::function<test::Solid(int)> make;  // of the number of sides
  Analytic expected;
  bool curved{true};
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

std::vector<Case> cases() {
  return {
      {"Box",
       [](int sides) {
         return test::box({0.12, 0.07, 0.6}, sides * 10 / 48);
       },
       make_analytic_box({0.12, 0.07, 0.6}), false},
      {"Cylinder", [](int sides) { return test::cylinder(0.05, 0.6, sides); }, make_analytic_cylinder(0.05, 0.05, 0.6)},
      {"EllipticCylinder",
       [](int sides) {
         return test::stretched(test::cylinder(0.06, 0.6, sides), {1.0, 0.5, 1.0});
       },
       make_analytic_cylinder(0.06, 0.03, 0.6)},
      {"Tube", [](int sides) { return test::tube(0.05, 0.04, 0.6, sides); }, make_analytic_tube(0.05, 0.04, 0.6)},
      {"Capsule", [](int sides) { return test::capsule(0.05, 0.6, sides); }, make_analytic_capsule(0.05, 0.6)},
  };
}

/// Largest relative errors.
struct Errors {
  double volume;
  double inertia;
  double section;
};

double relative(double value, double expected) { return std::abs(value / expected - 1.0); }

MassProperties measure(const test::Solid& solid) {
  return mass_properties(solid.triangles, solid.points, Matrix3d::Identity());
}

Section middle_section(const test::Solid& solid) {
  return build_doll(test::rig_of(solid, 0.0), test::without_minima()).sections[1];
}

Errors errors_of(const Case& c, int sides) {
  const test::Solid solid = c.make(sides);
  const MassProperties mass = measure(solid);
  const Section section = middle_section(solid);
  Errors errors{relative(mass.volume, c.expected.volume), 0.0, relative(section.area, c.expected.area)};
  for (int k = 0; k < 3; ++k) {
    errors.inertia = std::max(errors.inertia, relative(mass.inertia(k, k), c.expected.inertia[k]));
  }
  const double larger = std::max(c.expected.about_x, c.expected.about_y);
  const double smaller = std::min(c.expected.about_x, c.expected.about_y);
  errors.section =
      std::max({errors.section, relative(section.second_moments.x(), larger + smaller),
                relative(section.second_moments.y(), larger), relative(section.second_moments.z(), smaller)});
  return errors;
}

class Solids : public testing::TestWithParam<Case> {};

TEST_P(Solids, OfAThousandTriangles_HasItsMassAndInertia) {
  const test::Solid solid = GetParam().make(kSides);
  EXPECT_NEAR(static_cast<double>(solid.triangles.size()), 1000.0, 250.0);
  const MassProperties mass = measure(solid);
  EXPECT_FALSE(mass.estimated);
  const Errors errors = errors_of(GetParam(), kSides);
  EXPECT_LT(errors.volume, kTolerance);
  EXPECT_LT(errors.inertia, kTolerance);
  EXPECT_LT(mass.com.norm(), 1e-12);
  const Matrix3d products = mass.inertia - Matrix3d(mass.inertia.diagonal().asDiagonal());
  EXPECT_LT(products.norm(), 1e-12 * mass.inertia.norm());
}

TEST_P(Solids, OfAThousandTriangles_HasItsSection) {
  const Section section = middle_section(GetParam().make(kSides));
  const Analytic& expected = GetParam().expected;
  EXPECT_FALSE(section.estimated);
  EXPECT_LT(errors_of(GetParam(), kSides).section, kTolerance);
  for (int k = 0; k < 3; ++k) EXPECT_LT(relative(section.outermost[k], expected.outermost[k]), kTolerance) << k;
  const Matrix3d R = section.axes.toRotationMatrix();
  EXPECT_LT((R.col(0) - Vector3d::UnitY()).norm(), 1e-9);  // along the bone
  EXPECT_NEAR(std::abs(R.col(1).z()), 1.0, 1e-9);          // about the world's y, or as the bone lies if it is round
}

/// The corners are on the curved surface, the facets' sagitta falls with the square of their length.
TEST_P(Solids, Refined_ConvergesWithOrderTwo) {
  const Errors coarse = errors_of(GetParam(), kSides);
  const Errors fine = errors_of(GetParam(), 2 * kSides);
  const auto order = [](double before, double after) { return std::log2(before / after); };
  if (!GetParam().curved) {
    EXPECT_LT(coarse.inertia, 1e-12);
    EXPECT_LT(coarse.section, 1e-12);
    return;
  }
  EXPECT_NEAR(order(coarse.volume, fine.volume), 2.0, 0.1);
  EXPECT_NEAR(order(coarse.inertia, fine.inertia), 2.0, 0.1);
  EXPECT_NEAR(order(coarse.section, fine.section), 2.0, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Analytic, Solids, testing::ValuesIn(cases()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace layfigure::doll
