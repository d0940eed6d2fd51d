#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "layfigure/doll/build.h"
#include "rig_fixture.h"
#include "solids.h"

// Meshes that are no solids: what cannot be measured is estimated, and said so.
namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

bool mentions(const Doll& doll, const std::string& what) {
  for (const std::string& warning : doll.warnings) {
    if (warning.find(what) != std::string::npos) return true;
  }
  return false;
}

void expect_plausible(const Doll& doll) {
  EXPECT_NO_THROW(dynamics::Model{doll.definition});  // finite, positive, an inertia that a mass can have
  bool estimated = false;
  for (std::size_t b = 0; b < doll.sections.size(); ++b) {
    const Section& section = doll.sections[b];
    const dynamics::JointLaw& law = doll.definition.bodies[b].joint;
    estimated = estimated || section.estimated;
    EXPECT_TRUE(std::isfinite(section.area) && section.second_moments.allFinite() && section.outermost.allFinite());
    EXPECT_GT(section.area, 0.0);
    EXPECT_GT(section.second_moments.minCoeff(), 0.0);
    EXPECT_NEAR(section.axes.norm(), 1.0, 1e-12);
    if (doll.definition.bodies[b].parent < 0) continue;
    EXPECT_TRUE(std::isfinite(law.stiffness) && std::isfinite(law.yield_torque) && std::isfinite(law.flow_damping));
    EXPECT_GT(law.yield_torque, 0.0);
  }
  EXPECT_EQ(mentions(doll, "no section found"), estimated);
}

Doll doll_of(const test::Solid& solid) { return build_doll(test::rig_of(solid, 0.0)); }

double mass_of(const Doll& doll) {
  double mass = 0.0;
  for (const auto& body : doll.definition.bodies) mass += body.mass;
  return mass;
}

const test::Solid kCylinder = test::cylinder(0.05, 0.6, 48);

TEST(BrokenMesh, WithoutLids_IsTheSameDoll) {
  test::Solid open = kCylinder;
  std::erase_if(open.triangles, [&](const Eigen::Vector3i& t) {
    const double z = open.points[t[0]].z();
    return open.points[t[1]].z() == z && open.points[t[2]].z() == z;
  });
  ASSERT_LT(open.triangles.size(), kCylinder.triangles.size());
  const Doll doll = doll_of(open);
  const Doll whole = doll_of(kCylinder);
  expect_plausible(doll);
  EXPECT_NEAR(mass_of(doll), mass_of(whole), 1e-9 * mass_of(whole));
  EXPECT_LT((doll.sections[1].second_moments - whole.sections[1].second_moments).norm(),
            1e-9 * whole.sections[1].second_moments.norm());
}

TEST(BrokenMesh, WithHoles_IsNearlyTheSameDoll) {
  test::Solid holed = kCylinder;
  int k = 0;
  std::erase_if(holed.triangles, [&](const Eigen::Vector3i&) { return ++k % 17 == 0; });
  const Doll doll = doll_of(holed);
  const Doll whole = doll_of(kCylinder);
  expect_plausible(doll);
  EXPECT_NEAR(mass_of(doll), mass_of(whole), 0.05 * mass_of(whole));
  EXPECT_NEAR(doll.sections[1].area, whole.sections[1].area, 0.05 * whole.sections[1].area);
}

TEST(BrokenMesh, TwoSided_IsTheSameDoll) {
  test::Solid doubled = kCylinder;
  for (const auto& t : kCylinder.triangles) doubled.triangles.emplace_back(t[2], t[1], t[0]);
  const Doll doll = doll_of(doubled);
  expect_plausible(doll);
  EXPECT_TRUE(doll.definition.bodies[1].mass > 0.0 && !doll.sections[1].estimated);
  EXPECT_NEAR(mass_of(doll), mass_of(doll_of(kCylinder)), 1e-9 * mass_of(doll));
}

TEST(BrokenMesh, InsideOut_IsACapsuleAndReported) {
  test::Solid inside_out = kCylinder;
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  const Doll doll = doll_of(inside_out);
  expect_plausible(doll);
  EXPECT_TRUE(mentions(doll, "'bone1': its skin encloses hardly anything"));
  EXPECT_NEAR(mass_of(doll), mass_of(doll_of(kCylinder)), 0.2 * mass_of(doll));
  EXPECT_FALSE(doll.sections[1].estimated);
}

TEST(BrokenMesh, SkinsThatOverlap_WeighAtMostBoth) {
  test::Solid two = kCylinder;
  const int first = static_cast<int>(two.points.size());
  for (const Vector3d& point : kCylinder.points) two.points.emplace_back(point + Vector3d(0.03, 0.01, 0.002));
  for (const auto& t : kCylinder.triangles) two.triangles.emplace_back(t + Eigen::Vector3i::Constant(first));
  const Doll doll = doll_of(two);
  expect_plausible(doll);
  const double one = mass_of(doll_of(kCylinder));
  EXPECT_GT(mass_of(doll), 0.99 * one);
  EXPECT_LT(mass_of(doll), 2.01 * one);
}

TEST(BrokenMesh, FlatSheets_AreCapsulesAndReported) {
  const test::Solid sheet = test::stretched(test::box({0.1, 1.0, 0.6}, 5), {1.0, 0.0, 1.0});
  const Doll doll = doll_of(sheet);
  expect_plausible(doll);
  EXPECT_TRUE(mentions(doll, "'bone0': its skin encloses hardly anything"));
  EXPECT_TRUE(doll.sections[1].estimated);
}

/// Triangles anywhere, joined anyhow: every doll is one that the dynamics take.
TEST(BrokenMesh, RandomTriangles_MakeADollAllTheSame) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-0.3, 0.3);
    const int points = 6 + static_cast<int>(random() % 40);
    test::Solid soup;
    for (int k = 0; k < points; ++k) soup.points.emplace_back(place(random), place(random), place(random));
    for (int k = 0; k < 10 * points; ++k) {
      const auto corner = [&] { return static_cast<int>(random() % static_cast<unsigned>(points)); };
      soup.triangles.emplace_back(corner(), corner(), corner());
    }
    expect_plausible(doll_of(soup));
  }
}

}  // namespace
}  // namespace layfigure::doll
