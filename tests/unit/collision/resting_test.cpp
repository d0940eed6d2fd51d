#include <gtest/gtest.h>

#include <map>

#include "fixture.h"

namespace layfigure::collision {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::least_gap;
using testing::Random;

const Vector3d kHalf(0.1, 0.08, 0.05);

/// A box on the floor, on the same floor made of a box, and on one tilted.
std::vector<std::pair<Shape, Pose>> floors() {
  const Shape slab = testing::box({1.0, 1.0, 0.5});
  return {{Plane{}, {}}, {slab, {.position = {0.2, 0.3, -0.5}}}};
}

TEST(RestingBox, AnyGap_FourPointsWithThatGap) {
  for (const auto& [floor, X_WF] : floors()) {
    for (const double gap : {4e-3, 1e-4, 1e-6, 1e-9, 0.0, -1e-9, -1e-6, -1e-4, -4e-3}) {
      const auto contacts =
          testing::contacts_of(testing::box(kHalf), {.position = {0.0, 0.0, 0.05 + gap}}, floor, X_WF, 0.005);
      ASSERT_EQ(contacts.size(), 4U) << gap;
      for (const auto& contact : contacts) {
        EXPECT_NEAR(contact.gap, gap, 1e-15) << "no collision margin shows";
        EXPECT_LE((contact.normal_W - Vector3d::UnitZ()).norm(), 1e-15);
        EXPECT_NEAR(std::abs(contact.p_Wa.x()), 0.1, 1e-15);
        EXPECT_NEAR(std::abs(contact.p_Wa.y()), 0.08, 1e-15);
      }
    }
  }
}

TEST(RestingBox, JustBeyondActivity_NoContact) {
  for (const auto& [floor, X_WF] : floors()) {
    EXPECT_TRUE(
        testing::contacts_of(testing::box(kHalf), {.position = {0.0, 0.0, 0.055001}}, floor, X_WF, 0.005).empty());
  }
}

Pose trembling(Random& random, const Pose& rest, double amplitude) {
  const Eigen::AngleAxisd turn(amplitude * random.between(-1.0, 1.0), random.direction());
  return {Quaterniond(turn) * rest.rotation, rest.position + amplitude * random.direction()};
}

/// Features and places of the points while `body` trembles over the floor by micrometres, a thousand times.
void expect_steady(const Shape& body, const Pose& rest, const Shape& floor, const Pose& X_WF, std::size_t points) {
  World world(testing::pair_of(body, floor, 0.005));
  Random random(21);
  std::map<std::uint64_t, Vector3d> first;
  for (int k = 0; k < 1000; ++k) {
    const std::vector<Pose> poses{trembling(random, rest, 1e-6), X_WF};
    ASSERT_EQ(world.update(poses).status, UpdateStatus::kOk);
    ASSERT_EQ(world.contacts().size(), points) << "update " << k;
    for (const auto& contact : world.contacts()) {
      const auto [known, added] = first.try_emplace(contact.feature, contact.p_Wa);
      ASSERT_TRUE(k == 0 || !added) << "update " << k << ": another point";
      EXPECT_LE((known->second - contact.p_Wa).norm(), 5e-6);
    }
  }
}

TEST(RestingBox, Trembling_KeepsItsFourPoints) {
  for (const auto& [floor, X_WF] : floors()) {
    for (const double yaw : {0.0, 0.3, M_PI / 4}) {
      const Quaterniond turned(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
      expect_steady(testing::box(kHalf), {turned, {0.0, 0.0, 0.05}}, floor, X_WF, 4);
    }
  }
}

TEST(StackedBoxes, TremblingFlushOrTurned_KeepFourPoints) {
  // Turned by 45 degrees the common area is an octagon, of whose corners four are taken.
  for (const double yaw : {0.0, 0.2, M_PI / 4}) {
    const Quaterniond turned(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
    expect_steady(testing::box({0.1, 0.1, 0.05}), {turned, {0.0, 0.0, 0.1}}, testing::box({0.1, 0.1, 0.05}), {}, 4);
  }
}

TEST(OverhangingBox, Trembling_KeepsThePointsOnTheEdge) {
  expect_steady(testing::box(kHalf), {.position = {0.15, 0.01, 0.1}}, testing::box({0.1, 0.1, 0.05}), {}, 4);
}

TEST(RestingHull, TremblingOnItsFace_KeepsItsPoints) {
  ConvexHull hull{Random(22).cloud(30, 0.1)};
  hull.vertices.insert(hull.vertices.end(), {{0.08, 0.0, -0.11}, {-0.05, 0.06, -0.11}, {-0.05, -0.06, -0.11}});
  for (const auto& [floor, X_WF] : floors()) expect_steady(hull, {.position = {0, 0, 0.11}}, floor, X_WF, 3);
}

TEST(RestingCapsule, Trembling_KeepsItsTwoPoints) {
  const Quaterniond lying(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()));
  for (const auto& [floor, X_WF] : floors()) {
    expect_steady(Capsule{0.02, 0.1}, {lying, {0.0, 0.0, 0.02}}, floor, X_WF, 2);
  }
}

TEST(RestingBox, AKilometreAway_GapsAsNearTheOrigin) {
  // Rounding of world coordinates there: 1.1e-13 m.
  const Vector3d far(1000.3, -999.7, 512.1);
  Random random(23);
  for (const auto& [floor, X_WF] : floors()) {
    for (int k = 0; k < 20; ++k) {
      const Pose turn{random.rotation(), far};
      const Pose box{turn.rotation, turn.rotation * Vector3d(0.0, 0.0, 0.051) + far};
      const Pose below{turn.rotation * X_WF.rotation, turn.rotation * X_WF.position + far};
      const auto contacts = testing::contacts_of(testing::box(kHalf), box, floor, below, 0.005);
      ASSERT_EQ(contacts.size(), 4U);
      for (const auto& contact : contacts) EXPECT_NEAR(contact.gap, 0.001, 1e-12);
    }
  }
}

TEST(TiltedBox, OnItsCorner_DeepestPointIsTheCorner) {
  const Quaterniond tilted = Quaterniond::FromTwoVectors(kHalf, Vector3d::UnitZ());
  for (const auto& [floor, X_WF] : floors()) {
    const Pose pose{tilted, {0.0, 0.0, kHalf.norm() - 0.001}};
    const auto contacts = testing::contacts_of(testing::box(kHalf), pose, floor, X_WF, 0.005);
    ASSERT_FALSE(contacts.empty());
    EXPECT_NEAR(least_gap(contacts), -0.001, 1e-14);
  }
}

}  // namespace
}  // namespace layfigure::collision
