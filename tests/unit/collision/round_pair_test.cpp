#include <gtest/gtest.h>

#include <cmath>

#include "fixture.h"

namespace layfigure::collision {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::contacts_of;
using testing::Random;

constexpr double kRounding = 1e-14;
const Quaterniond kUpright = Quaterniond::Identity();
const Quaterniond kAlongX(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()));

TEST(SpherePair, AnyDirection_GapIsDistanceLessRadii) {
  Random random(1);
  for (int k = 0; k < 100; ++k) {
    const Vector3d n = random.direction();
    const double gap = random.between(-0.05, 0.019);
    const Pose b{random.rotation(), random.direction()};
    const Pose a{random.rotation(), b.position + (0.1 + 0.05 + gap) * n};
    const auto contacts = contacts_of(Sphere{0.1}, a, Sphere{0.05}, b);
    ASSERT_EQ(contacts.size(), 1U);
    EXPECT_NEAR(contacts[0].gap, gap, kRounding);
    EXPECT_LE((contacts[0].normal_W - n).norm(), 1e-13) << "from b to a";
    EXPECT_LE((contacts[0].p_Wb - b.position - 0.05 * n).norm(), kRounding);
  }
}

TEST(SpherePair, BeyondActivity_NoContact) {
  EXPECT_TRUE(contacts_of(Sphere{0.1}, {}, Sphere{0.1}, {.position = {0.0, 0.0, 0.2201}}).empty());
}

TEST(SpherePair, SameCentre_UnitNormalAndFullOverlap) {
  const auto contacts = contacts_of(Sphere{0.1}, {}, Sphere{0.05}, {});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, -0.15, kRounding);
}

TEST(SphereCapsule, BesideTheSegment_GapFromItsLine) {
  const auto contacts =
      contacts_of(Sphere{0.03}, {.position = {0.085, 0.0, 0.07}}, Capsule{0.05, 0.1}, {kUpright, Vector3d::Zero()});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, 0.005, kRounding);
  EXPECT_LE((contacts[0].normal_W - Vector3d::UnitX()).norm(), kRounding);
  EXPECT_LE((contacts[0].p_Wb - Vector3d(0.05, 0.0, 0.07)).norm(), kRounding);
}

TEST(SphereCapsule, BeyondTheEnd_GapFromItsCap) {
  const Vector3d n = Vector3d(1.0, 2.0, 3.0).normalized();
  const auto contacts =
      contacts_of(Sphere{0.03}, {.position = Vector3d(0.0, 0.0, 0.1) + 0.075 * n}, Capsule{0.05, 0.1}, {});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, -0.005, kRounding);
  EXPECT_LE((contacts[0].normal_W - n).norm(), 1e-13);
}

TEST(SphereCapsule, CentreOnTheAxis_NormalSquareToIt) {
  const auto contacts = contacts_of(Sphere{0.03}, {.position = {0.0, 0.0, 0.02}}, Capsule{0.05, 0.1}, {});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, -0.08, kRounding);
  EXPECT_NEAR(contacts[0].normal_W.z(), 0.0, kRounding);
}

TEST(CapsulePair, Crossed_GapBetweenTheAxes) {
  const auto contacts = contacts_of(Capsule{0.02, 0.1}, {kAlongX, {0.03, 0.01, 0.055}}, Capsule{0.03, 0.2},
                                    {Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX())), Vector3d::Zero()});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, 0.005, kRounding);
  EXPECT_LE((contacts[0].p_Wa - Vector3d(0.0, 0.01, 0.035)).norm(), kRounding);
}

TEST(CapsulePair, CrossingAxes_SeparatedAcrossBoth) {
  const auto contacts = contacts_of(Capsule{0.02, 0.1}, {kAlongX, Vector3d::Zero()}, Capsule{0.03, 0.2}, {});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, -0.05, kRounding);
  EXPECT_NEAR(std::abs(contacts[0].normal_W.y()), 1.0, kRounding);
}

TEST(CapsulePair, Parallel_PointAtEachEndOfTheOverlap) {
  const auto contacts = contacts_of(Capsule{0.02, 0.1}, {.position = {0.06, 0.0, 0.15}}, Capsule{0.03, 0.1}, {});
  ASSERT_EQ(contacts.size(), 2U);
  for (const auto& contact : contacts) EXPECT_NEAR(contact.gap, 0.01, kRounding);
  EXPECT_NEAR(std::min(contacts[0].p_Wa.z(), contacts[1].p_Wa.z()), 0.05, kRounding);
  EXPECT_NEAR(std::max(contacts[0].p_Wa.z(), contacts[1].p_Wa.z()), 0.1, kRounding);
}

TEST(CapsulePair, SlightlyTilted_EachPointHasItsOwnGap) {
  const double tilt = 0.01;
  const Quaterniond turned = Quaterniond(Eigen::AngleAxisd(tilt, Vector3d::UnitY()));
  const auto contacts = contacts_of(Capsule{0.02, 0.1}, {turned, {0.06, 0.0, 0.0}}, Capsule{0.03, 0.3}, {});
  ASSERT_EQ(contacts.size(), 2U);
  for (const double side : {-1.0, 1.0}) {
    const double distance = 0.06 + side * 0.1 * std::sin(tilt);
    const auto& contact = contacts[(contacts[0].p_Wa.z() > 0.0) == (side > 0.0) ? 0 : 1];
    EXPECT_NEAR(contact.gap, distance - 0.05, 1e-13);
  }
}

TEST(CapsulePair, OnOneLine_TouchAtTheEnds) {
  const auto contacts = contacts_of(Capsule{0.02, 0.1}, {.position = {0.0, 0.0, 0.26}}, Capsule{0.03, 0.1}, {});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, 0.01, kRounding);
}

TEST(PlanePair, RoundShapesAnyOrientation_GapFromTheSurface) {
  Random random(2);
  for (int k = 0; k < 100; ++k) {
    const Pose floor{random.rotation(), random.direction()};
    const Vector3d n = floor.rotation * Vector3d::UnitZ();
    const Pose body{random.rotation(), floor.position + random.between(0.0, 0.14) * n + n.unitOrthogonal()};
    const double height = n.dot(body.position - floor.position);
    const Vector3d half = body.rotation * Vector3d(0.0, 0.0, 0.1);
    const auto sphere = contacts_of(Sphere{0.13}, body, Plane{}, floor);
    ASSERT_EQ(sphere.size(), 1U);
    EXPECT_NEAR(sphere[0].gap, height - 0.13, kRounding);
    EXPECT_LE((sphere[0].normal_W - n).norm(), kRounding);
    const auto capsule = contacts_of(Capsule{0.05, 0.1}, body, Plane{}, floor, /*activity=*/1.0);
    ASSERT_EQ(capsule.size(), 2U);
    EXPECT_NEAR(testing::least_gap(capsule), height - std::abs(n.dot(half)) - 0.05, kRounding);
  }
}

TEST(PlanePair, PlaneListedFirst_NormalStillFromThePlane) {
  const auto contacts = contacts_of(Plane{}, {}, Sphere{0.1}, {.position = {0.0, 0.0, 0.1}});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_EQ(contacts[0].body_a, 1);
  EXPECT_LE((contacts[0].normal_W - Vector3d::UnitZ()).norm(), kRounding);
}

TEST(PlanePair, TwoPlanes_NeverMeet) { EXPECT_TRUE(contacts_of(Plane{}, {}, Plane{}, {}).empty()); }

}  // namespace
}  // namespace layfigure::collision
