#include <gtest/gtest.h>

#include "fixture.h"
#include "reference.h"

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;
using testing::contacts_of;
using testing::least_gap;
using testing::Points;
using testing::Random;

// A face is preferred until an edge parts the hulls by this much more: 1e-5 of a size of 0.1 m.
constexpr double kKept = 1.1e-6;

struct HullPair {
  ConvexHull a, b;
  Pose X_WA, X_WB;
};

Points placed(const ConvexHull& hull, const Pose& pose) {
  Points result;
  for (const auto& v : hull.vertices) result.push_back(pose.rotation * v + pose.position);
  return result;
}

/// Hulls of so many vertices whose extents along a random direction overlap by `overlap`.
HullPair random_pair(Random& random, int count_a, int count_b, double overlap) {
  HullPair pair{{random.cloud(count_a, 0.1)}, {random.cloud(count_b, 0.1)}, {}, {}};
  pair.X_WA = {random.rotation(), random.direction()};
  pair.X_WB = {random.rotation(), pair.X_WA.position};
  const Vector3d n = random.direction();
  double highest = -1.0, lowest = 1.0;
  for (const auto& v : placed(pair.a, pair.X_WA)) highest = std::max(highest, n.dot(v - pair.X_WA.position));
  for (const auto& v : placed(pair.b, pair.X_WB)) lowest = std::min(lowest, n.dot(v - pair.X_WB.position));
  pair.X_WB.position += (highest - lowest - overlap) * n;
  return pair;
}

double reference_of(const HullPair& pair) {
  return testing::signed_distance(placed(pair.a, pair.X_WA), placed(pair.b, pair.X_WB));
}

double gap_of(const HullPair& pair) { return least_gap(contacts_of(pair.a, pair.X_WA, pair.b, pair.X_WB)); }

TEST(HullPair, RandomPoses_GapIsThatOfExhaustiveSearch) {
  Random random(3);
  int touching = 0, overlapping = 0;
  for (const auto& [a, b] : {std::pair{4, 4}, {4, 8}, {8, 8}, {6, 12}, {12, 12}}) {
    for (int k = 0; k < 60; ++k) {
      const HullPair pair = random_pair(random, a, b, random.between(-0.005, 0.03));
      const double expected = reference_of(pair), gap = gap_of(pair);
      if (expected > 0.02 - kKept) continue;
      EXPECT_NEAR(gap, expected, kKept) << a << " and " << b << " vertices, scene " << k;
      (expected > 0.0 ? touching : overlapping)++;
    }
  }
  EXPECT_GT(touching, 50);
  EXPECT_GT(overlapping, 50);
}

TEST(HullPair, Touching_FollowedWithoutSearchingAnew) {
  Random random(4);
  int updates = 0, searches = 0;
  for (int scene = 0; scene < 12; ++scene) {
    HullPair pair = random_pair(random, 16, 16, random.between(-0.002, 0.002));
    World world(testing::pair_of(pair.a, pair.b, 0.02));
    for (int step = 0; step < 40; ++step) {
      const UpdateReport report = world.update(std::vector<Pose>{pair.X_WA, pair.X_WB});
      ASSERT_EQ(report.status, UpdateStatus::kOk);
      const double expected = reference_of(pair);
      if (expected <= 0.02 - kKept) {
        ASSERT_NEAR(least_gap(world.contacts()), expected, kKept) << "scene " << scene << ", step " << step;
      }
      updates += step > 0 ? 1 : 0;
      searches += step > 0 ? report.direction_searches : 0;
      pair.X_WB.position += 2e-4 * random.direction();
      pair.X_WB.rotation = Eigen::AngleAxisd(4e-3, random.direction()) * pair.X_WB.rotation;
    }
  }
  EXPECT_LT(searches, updates / 10);
}

TEST(HullPair, FlatSegmentAndPointHulls_GapIsThatOfExhaustiveSearch) {
  Random random(4);
  int compared = 0;
  for (const auto& [a, b] : {std::pair{1, 8}, {2, 8}, {3, 8}, {2, 3}, {3, 3}, {8, 1}, {3, 2}}) {
    for (int k = 0; k < 60; ++k) {
      const HullPair pair = random_pair(random, a, b, random.between(-0.005, 0.03));
      const double expected = reference_of(pair);
      if (expected > 0.02 - kKept) continue;
      ++compared;
      EXPECT_NEAR(gap_of(pair), expected, kKept) << a << " and " << b << " vertices, scene " << k;
    }
  }
  EXPECT_GT(compared, 50);
}

TEST(HullPair, OrderSwapped_SameGapOppositeNormal) {
  Random random(5);
  for (int k = 0; k < 50; ++k) {
    const HullPair pair = random_pair(random, 10, 14, 0.001);
    const auto one = contacts_of(pair.a, pair.X_WA, pair.b, pair.X_WB);
    const auto other = contacts_of(pair.b, pair.X_WB, pair.a, pair.X_WA);
    EXPECT_NEAR(std::min(least_gap(one), 0.02), std::min(least_gap(other), 0.02), kKept);
    if (one.size() == 1 && other.size() == 1) {
      EXPECT_LE((one[0].normal_W + other[0].normal_W).norm(), 1e-3);
    }
  }
}

TEST(HullPair, CrossedEdges_ExactAtAnyGap) {
  // Two boxes on edge, one turned by a right angle: the edges cross, however near.
  const Eigen::Quaterniond on_edge(Eigen::AngleAxisd(M_PI / 4, Vector3d::UnitX()));
  const Eigen::Quaterniond across = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ())) * on_edge;
  const double reach = 0.05 * std::sqrt(2.0);
  for (const double gap : {1e-2, 1e-4, 1e-6, 1e-8, 1e-12, 0.0, -1e-8, -1e-6, -1e-4, -1e-3}) {
    const auto contacts = contacts_of(testing::box({0.1, 0.05, 0.05}), {across, {0.01, 0.02, 2 * reach + gap}},
                                      testing::box({0.1, 0.05, 0.05}), {on_edge, Vector3d::Zero()});
    ASSERT_EQ(contacts.size(), 1U) << gap;
    EXPECT_NEAR(contacts[0].gap, gap, 1e-15);
    // Between points a small distance apart the direction has fewer digits.
    EXPECT_LE((contacts[0].normal_W - Vector3d::UnitZ()).norm(), gap > 1e-7 ? 1e-16 / gap : 1e-14);
    EXPECT_LE((contacts[0].p_Wb - Vector3d(0.01, 0.0, reach)).norm(), 1e-9);
  }
}

TEST(HullPair, DeepInside_NormalParts) {
  Random random(6);
  for (int k = 0; k < 50; ++k) {
    const HullPair pair = random_pair(random, 24, 32, 0.15);
    const auto contacts = contacts_of(pair.a, pair.X_WA, pair.b, pair.X_WB);
    ASSERT_FALSE(contacts.empty());
    Points moved = placed(pair.a, pair.X_WA);
    for (auto& v : moved) v -= (least_gap(contacts) - 1e-9) * contacts[0].normal_W;
    double low = 1e9, high = -1e9;
    for (const auto& v : moved) low = std::min(low, contacts[0].normal_W.dot(v));
    for (const auto& v : placed(pair.b, pair.X_WB)) high = std::max(high, contacts[0].normal_W.dot(v));
    EXPECT_GE(low, high - kKept) << "moved by the gap along the normal, they do not overlap";
  }
}

TEST(HullSphere, OverFaceEdgeAndCorner_ClosedForms) {
  const ConvexHull box = testing::box({0.1, 0.1, 0.1});
  const double r = 0.03;
  struct Case {
    Vector3d corner, n;
  };
  for (const auto& [corner, n] :
       {Case{{0.02, 0.03, 0.1}, {0, 0, 1}}, Case{{0.1, 0.02, 0.1}, {1, 0, 1}}, Case{{0.1, 0.1, 0.1}, {1, 2, 3}}}) {
    const Vector3d unit = n.normalized();
    for (const double gap : {0.015, 1e-9, -0.02}) {
      const auto contacts = contacts_of(Sphere{r}, {.position = corner + (r + gap) * unit}, box, {});
      ASSERT_EQ(contacts.size(), 1U);
      EXPECT_NEAR(contacts[0].gap, gap, 1e-15);
      EXPECT_LE((contacts[0].normal_W - unit).norm(), 1e-13);
      EXPECT_LE((contacts[0].p_Wb - corner).norm(), 1e-14);
    }
  }
}

TEST(HullSphere, CentreInside_OutByTheNearestFace) {
  const auto contacts = contacts_of(Sphere{0.03}, {.position = {0.0, 0.09, 0.01}}, testing::box({0.1, 0.1, 0.1}), {});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, -0.04, 1e-15);
  EXPECT_LE((contacts[0].normal_W - Vector3d::UnitY()).norm(), 1e-14);
}

TEST(HullCapsule, LyingOnAFace_TwoPointsCutAtItsBorder) {
  const Eigen::Quaterniond lying(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()));
  const auto contacts = contacts_of(Capsule{0.02, 0.2}, {lying, {0.15, 0.0, 0.121}}, testing::box({0.1, 0.1, 0.1}), {});
  ASSERT_EQ(contacts.size(), 2U);
  for (const auto& contact : contacts) EXPECT_NEAR(contact.gap, 0.001, 1e-15);
  EXPECT_NEAR(std::min(contacts[0].p_Wa.x(), contacts[1].p_Wa.x()), -0.05, 1e-14);
  EXPECT_NEAR(std::max(contacts[0].p_Wa.x(), contacts[1].p_Wa.x()), 0.1, 1e-14);
}

TEST(HullCapsule, AcrossAnEdge_GapFromTheAxis) {
  // Over the middle of the edge at x = z = 0.1, in no plane of the box.
  const Vector3d n = Vector3d(1.0, 0.0, 1.0).normalized();
  const Vector3d along = Vector3d(1.0, 1.0, -1.0).normalized();
  const Eigen::Quaterniond turned = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), along);
  const auto contacts =
      contacts_of(Capsule{0.02, 0.2}, {turned, Vector3d(0.1, 0.0, 0.1) + 0.025 * n}, testing::box({0.1, 0.1, 0.1}), {});
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].gap, 0.005, 1e-15);
  EXPECT_LE((contacts[0].normal_W - n).norm(), 1e-13);
}

}  // namespace
}  // namespace layfigure::collision
