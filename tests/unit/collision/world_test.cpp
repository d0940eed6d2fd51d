#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "fixture.h"

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;
using testing::Random;

constexpr int kLimbs = 50;

WorldDefinition limbs_on_floor() {
  WorldDefinition definition = testing::limbs(kLimbs);
  definition.shapes.push_back({.name = "floor", .shape = Plane{}});
  return definition;
}

/// Two boxes, the upper one by so much larger than the lower one.
WorldDefinition two_boxes(double growth) {
  WorldDefinition definition;
  definition.bodies = 2;
  for (int body = 0; body < 2; ++body) {
    ConvexHull box;
    const double half = body == 0 ? 0.1 : 0.1 * growth;
    for (int corner = 0; corner < 8; ++corner) {
      box.vertices.emplace_back((corner & 1) != 0 ? half : -half, (corner & 2) != 0 ? half : -half,
                                (corner & 4) != 0 ? half : -half);
    }
    definition.shapes.push_back({.name = "box", .shape = box, .body = body});
  }
  return definition;
}

TEST(World, MadeLikeAnother_IsTheSameAsMadeAnew) {
  const std::vector<Pose> poses{{}, {.position = {0.02, 0.01, 0.2}}};
  const World first(two_boxes(1.0));
  for (const double growth : {1.0, 1.5}) {  // the second is no shape that the first has
    World anew(two_boxes(growth));
    World like(two_boxes(growth), first);
    ASSERT_EQ(anew.update(poses).status, UpdateStatus::kOk);
    ASSERT_EQ(like.update(poses).status, UpdateStatus::kOk);
    ASSERT_EQ(anew.contacts().size(), like.contacts().size());
    ASSERT_FALSE(anew.contacts().empty());
    for (std::size_t k = 0; k < anew.contacts().size(); ++k) {
      EXPECT_EQ(anew.contacts()[k].p_Wa, like.contacts()[k].p_Wa);
      EXPECT_EQ(anew.contacts()[k].p_Wb, like.contacts()[k].p_Wb);
      EXPECT_EQ(anew.contacts()[k].gap, like.contacts()[k].gap);
    }
  }
}

TEST(World, FiftyLimbsAloneInTheAir_NoNarrowTest) {
  World world(testing::limbs(kLimbs));
  const UpdateReport report = world.update(testing::limb_poses(kLimbs, 1.0));
  EXPECT_EQ(report.narrow_tests, 0);
  EXPECT_LE(report.box_tests, 2 * kLimbs) << "not all pairs";
  EXPECT_TRUE(world.contacts().empty());
}

TEST(World, OneGroupAndNoFloor_NothingTestedAtAll) {
  WorldDefinition definition = testing::limbs(kLimbs);
  for (auto& shape : definition.shapes) shape.group = 1;
  World world(definition);
  std::vector<Pose> heap(kLimbs);
  const UpdateReport report = world.update(heap);
  EXPECT_EQ(report.box_tests, 0);
  EXPECT_EQ(report.narrow_tests, 0);
}

TEST(World, GroupAndAPointer_OnlyThePointerIsTested) {
  WorldDefinition definition = testing::limbs(kLimbs);
  for (auto& shape : definition.shapes) shape.group = 1;
  definition.bodies = kLimbs + 1;
  definition.shapes.push_back({.name = "pointer", .shape = Sphere{0.01}, .body = kLimbs});
  World world(definition);
  std::vector<Pose> poses = testing::limb_poses(kLimbs, 1.0);
  poses.push_back({.position = {0.15 * 20, 0.0, 1.07}});
  const UpdateReport report = world.update(poses);
  EXPECT_GE(report.narrow_tests, 1);
  EXPECT_LE(report.narrow_tests, 3);
  poses.back().position.z() = 5.0;
  EXPECT_EQ(world.update(poses).narrow_tests, 0);
}

TEST(World, FloorFarBelow_NoNarrowTest) {
  World world(limbs_on_floor());
  EXPECT_EQ(world.update(testing::limb_poses(kLimbs, 1.0)).narrow_tests, 0);
}

TEST(World, NothingMoved_ContactsKeptUntested) {
  World world(limbs_on_floor());
  const auto poses = testing::limb_poses(kLimbs, 0.06);
  EXPECT_GE(world.update(poses).narrow_tests, kLimbs);
  const std::vector<ContactPoint> before(world.contacts().begin(), world.contacts().end());
  ASSERT_FALSE(before.empty());
  const UpdateReport report = world.update(poses);
  EXPECT_EQ(report.box_tests, 0);
  EXPECT_EQ(report.narrow_tests, 0);
  EXPECT_TRUE(testing::same(before, world.contacts()));
}

TEST(World, OneLimbMoved_OnlyItsPairsTested) {
  World world(limbs_on_floor());
  auto poses = testing::limb_poses(kLimbs, 0.06);
  ASSERT_EQ(world.update(poses).status, UpdateStatus::kOk);
  const std::size_t before = world.contacts().size();
  poses[10].position.z() += 1e-4;
  EXPECT_EQ(world.update(poses).narrow_tests, 1);
  EXPECT_EQ(world.contacts().size(), before);
}

TEST(World, LimbLeavesAndReturns_ContactsFollow) {
  World world(testing::pair_of(Sphere{0.1}, Plane{}, 0.005));
  for (const double height : {0.1, 1.0, 0.1}) {
    const std::vector<Pose> poses{{.position = {0.0, 0.0, height}}, {}};
    ASSERT_EQ(world.update(poses).status, UpdateStatus::kOk);
    EXPECT_EQ(world.contacts().size(), height < 0.5 ? 1U : 0U);
  }
}

TEST(World, ExcludedBodiesAndOneBodysShapes_NeverMeet) {
  WorldDefinition definition;
  definition.bodies = 3;
  for (int i = 0; i < 3; ++i) definition.shapes.push_back({.name = "ball", .shape = Sphere{0.1}, .body = i});
  definition.shapes.push_back({.name = "second", .shape = Sphere{0.1}, .body = 0});
  definition.shapes.push_back({.name = "table", .shape = testing::box({1, 1, 1})});
  definition.excluded = {{1, 0}, {kWorldBody, 2}};
  World world(definition);
  ASSERT_EQ(world.update(std::vector<Pose>(3)).status, UpdateStatus::kOk);
  std::set<std::pair<int, int>> met;
  for (const auto& c : world.contacts()) met.insert(std::minmax(c.body_a, c.body_b));
  EXPECT_EQ(met, (std::set<std::pair<int, int>>{{-1, 0}, {-1, 1}, {0, 2}, {1, 2}}));
  for (const auto& c : world.contacts()) EXPECT_GE(c.body_a, 0) << "the world is always b";
}

TEST(World, Friction_IsTheGeometricMean) {
  WorldDefinition definition = testing::pair_of(Sphere{0.1}, Plane{}, 0.005);
  definition.shapes[0].friction = 0.9;
  definition.shapes[1].friction = 0.4;
  World world(definition);
  ASSERT_EQ(world.update(std::vector<Pose>(2)).status, UpdateStatus::kOk);
  ASSERT_EQ(world.contacts().size(), 1U);
  EXPECT_NEAR(world.contacts()[0].friction, 0.6, 1e-15);
}

TEST(World, FeaturesOfAPair_AreDistinct) {
  World world(limbs_on_floor());
  ASSERT_EQ(world.update(testing::limb_poses(kLimbs, 0.05)).status, UpdateStatus::kOk);
  std::set<std::tuple<int, int, std::uint64_t>> names;
  for (const auto& c : world.contacts()) names.emplace(c.shape_a, c.shape_b, c.feature);
  EXPECT_EQ(names.size(), world.contacts().size());
}

TEST(World, BadPose_RefusedAndContactsKept) {
  World world(testing::pair_of(Sphere{0.1}, Plane{}, 0.005));
  std::vector<Pose> poses{{.position = {0.0, 0.0, 0.1}}, {}};
  ASSERT_EQ(world.update(poses).status, UpdateStatus::kOk);
  const std::vector<ContactPoint> before(world.contacts().begin(), world.contacts().end());
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const Pose& bad : {Pose{.position = {nan, 0.0, 0.0}}, Pose{.position = {0.0, infinity, 0.0}},
                          Pose{Eigen::Quaterniond(nan, 0.0, 0.0, 0.0), Vector3d::Zero()},
                          Pose{Eigen::Quaterniond(1.1, 0.0, 0.0, 0.0), Vector3d::Zero()},
                          Pose{Eigen::Quaterniond(0.0, 0.0, 0.0, 0.0), Vector3d::Zero()}}) {
    const std::vector<Pose> given{poses[0], bad};
    const UpdateReport report = world.update(given);
    EXPECT_EQ(report.status, UpdateStatus::kBadPose);
    EXPECT_EQ(report.bad_body, 1);
    EXPECT_TRUE(testing::same(before, world.contacts()));
  }
  const UpdateReport missing = world.update(std::span(poses).first(1));
  EXPECT_EQ(missing.status, UpdateStatus::kBadPose);
  EXPECT_EQ(missing.bad_body, 1);
  EXPECT_EQ(world.update(poses).status, UpdateStatus::kOk);
}

TEST(World, HugeCoordinates_NothingBreaks) {
  World world(testing::pair_of(testing::box({0.1, 0.1, 0.1}), testing::box({0.1, 0.1, 0.1}), 0.005));
  for (const double far : {1e9, 1e150, 1e300, 1.7e308}) {
    const std::vector<Pose> poses{{.position = {far, -far, far}}, {.position = {-far, far, -far}}};
    EXPECT_EQ(world.update(poses).status, UpdateStatus::kOk);
    EXPECT_TRUE(world.contacts().empty());
  }
}

/// Poses of a heap of limbs that tremble and drift; the same for one seed.
std::vector<std::vector<Pose>> motion(int steps) {
  Random random(31);
  std::vector<std::vector<Pose>> history;
  auto poses = testing::limb_poses(20, 0.09);
  for (int k = 0; k < steps; ++k) {
    for (auto& pose : poses) {
      pose.position += 1e-3 * random.direction();
      pose.rotation = (Eigen::AngleAxisd(0.01, random.direction()) * pose.rotation).normalized();
    }
    history.push_back(poses);
  }
  return history;
}

WorldDefinition heap() {
  WorldDefinition definition = testing::limbs(20);
  definition.excluded.clear();
  definition.shapes.push_back({.name = "floor", .shape = Plane{}});
  return definition;
}

TEST(World, SameHistory_SameContactsBitForBit) {
  World one(heap()), other(heap());
  std::size_t contacts = 0;
  for (const auto& poses : motion(200)) {
    ASSERT_EQ(one.update(poses).status, UpdateStatus::kOk);
    ASSERT_EQ(other.update(poses).status, UpdateStatus::kOk);
    ASSERT_TRUE(testing::same(one.contacts(), other.contacts()));
    contacts += one.contacts().size();
  }
  EXPECT_GT(contacts, 1000U);
}

TEST(World, Forgotten_AsAfterConstruction) {
  World used(heap());
  for (const auto& poses : motion(100)) ASSERT_EQ(used.update(poses).status, UpdateStatus::kOk);
  used.forget();
  EXPECT_TRUE(used.contacts().empty());
  World fresh(heap());
  for (const auto& poses : motion(50)) {
    ASSERT_EQ(used.update(poses).status, UpdateStatus::kOk);
    ASSERT_EQ(fresh.update(poses).status, UpdateStatus::kOk);
    ASSERT_TRUE(testing::same(used.contacts(), fresh.contacts()));
  }
}

TEST(World, NoShapes_NoContacts) {
  World world({.bodies = 2, .shapes = {}, .excluded = {}});
  EXPECT_EQ(world.update(std::vector<Pose>(2)).status, UpdateStatus::kOk);
  EXPECT_TRUE(world.contacts().empty());
}

}  // namespace
}  // namespace layfigure::collision
