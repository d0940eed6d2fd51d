// What is skipped between updates must never be missed: worlds that remember against worlds made anew at each pose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fixture.h"

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;
using testing::Random;

constexpr double kActivity = 0.005;
constexpr double kSize = 0.1;
// A face may be kept while another's gap is larger by 1e-5 of the smaller shape's size.
constexpr double kHysteresis = 1e-5 * 1.1 * kSize;
// Deeper than this, which normal is found depends on where the search began.
constexpr double kShallow = -0.003;

/// Hulls, capsules and balls, a floor and a table; if wanted, a half-space that the last body carries.
WorldDefinition crowd(Random& random, int bodies, bool carried_plane) {
  WorldDefinition definition;
  definition.bodies = bodies;
  definition.activity = kActivity;
  for (int body = 0; body < bodies; ++body) {
    const Pose off{.rotation = random.rotation(), .position = 0.05 * random.direction()};
    Shape shape = Sphere{0.5 * kSize};
    if (body % 3 == 0) shape = ConvexHull{random.cloud(24, kSize)};
    if (body % 3 == 1) shape = Capsule{.radius = 0.3 * kSize, .half_length = 0.6 * kSize};
    definition.shapes.push_back({.name = "shape", .shape = shape, .body = body, .X_BS = off});
  }
  definition.shapes.push_back({.name = "floor", .shape = Plane{}});
  definition.shapes.push_back({.name = "table", .shape = testing::box({0.3, 0.3, 0.05})});
  if (carried_plane) definition.shapes.push_back({.name = "plate", .shape = Plane{}, .body = bodies - 1});
  return definition;
}

std::map<std::pair<int, int>, double> least_gaps(const World& world) {
  std::map<std::pair<int, int>, double> gaps;
  for (const ContactPoint& point : world.contacts()) {
    const auto [entry, is_new] = gaps.try_emplace({point.shape_a, point.shape_b}, point.gap);
    if (!is_new) entry->second = std::min(entry->second, point.gap);
  }
  return gaps;
}

void expect_same_pairs(const World& world, const World& anew, int step) {
  const auto found = least_gaps(world);
  const auto wanted = least_gaps(anew);
  for (const auto& [shapes, gap] : wanted) {
    const auto entry = found.find(shapes);
    ASSERT_NE(entry, found.end()) << "step " << step << ": shapes " << shapes.first << " and " << shapes.second
                                  << " were missed at a gap of " << gap << " m";
    if (gap > kShallow) {
      ASSERT_NEAR(entry->second, gap, kHysteresis) << "step " << step;
    }
  }
  ASSERT_EQ(found.size(), wanted.size()) << "step " << step;
}

/// A crowd whose bodies wander in a box, each at a speed of its own up to `speed` [m per update].
struct Wandering {
  Random random;
  WorldDefinition definition;
  std::vector<Pose> poses;
  std::vector<double> speeds;

  Wandering(unsigned seed, int bodies, double speed, bool carried_plane)
      : random(seed), definition(crowd(random, bodies, carried_plane)) {
    for (int body = 0; body < bodies; ++body) {
      poses.push_back({.rotation = random.rotation(), .position = 0.4 * random.direction() + 0.4 * Vector3d::UnitZ()});
      speeds.push_back(speed * random.between(0.0, 1.0));
    }
  }

  /// Every other body stands still in every other step.
  void move(int step) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if ((step + i) % 2 == 0 && i % 2 == 0) continue;
      const Vector3d turn = speeds[i] / kSize * random.direction();
      const double angle = turn.norm();
      if (angle > 0.0) poses[i].rotation = (Eigen::AngleAxisd(angle, turn / angle) * poses[i].rotation).normalized();
      poses[i].position = (poses[i].position + speeds[i] * random.direction()).cwiseMax(-0.5).cwiseMin(0.9);
    }
  }
};

struct Course {
  unsigned seed;
  int bodies;
  double speed;       ///< most [m per update]
  double reach_part;  ///< reach that is told, of the speed
  double carrying;    ///< speed at which all are carried along besides [m per update]
  bool carried_plane;
  const char* name;
};

/// The carrier of all after so many updates at a speed, going round at a radius of 0.5 m.
Pose carrier(double speed, int step) {
  const Eigen::AngleAxisd turn(speed / 0.5 * step, Vector3d(0.0, 0.6, 0.8));
  return {.rotation = Eigen::Quaterniond(turn), .position = 0.5 * (turn * Vector3d::UnitX())};
}

std::vector<Pose> carried(const Pose& X_WC, const std::vector<Pose>& X_CB) {
  std::vector<Pose> X_WB;
  for (const Pose& pose : X_CB) {
    X_WB.push_back({.rotation = (X_WC.rotation * pose.rotation).normalized(),
                    .position = X_WC.position + X_WC.rotation * pose.position});
  }
  return X_WB;
}

class NearPairs : public ::testing::TestWithParam<Course> {};

TEST_P(NearPairs, WhileBodiesWander_NoContactIsMissed) {
  const Course& course = GetParam();
  Wandering crowd(course.seed, course.bodies, course.speed, course.carried_plane);
  World world(crowd.definition);
  int skipped = 0;
  for (int step = 0; step < 400; ++step) {
    std::vector<double> reach;
    for (const double speed : crowd.speeds) reach.push_back(course.reach_part * (speed + 2.0 * course.carrying));
    const std::vector<Pose> poses = carried(carrier(course.carrying, step), crowd.poses);
    const UpdateReport report = world.update(poses, reach);
    ASSERT_EQ(report.status, UpdateStatus::kOk);
    skipped += report.box_tests == 0 ? 1 : 0;
    World anew(crowd.definition, world);
    ASSERT_EQ(anew.update(poses, reach).status, UpdateStatus::kOk);
    ASSERT_NO_FATAL_FAILURE(expect_same_pairs(world, anew, step));
    crowd.move(step);
    if (step % 97 == 96) crowd.poses[0].position += Vector3d(0.3, -0.2, 0.1);  // further than was told
  }
  if (course.reach_part > 0.0 && !course.carried_plane) {
    EXPECT_GT(skipped, 0) << "nothing was skipped";
  }
}

INSTANTIATE_TEST_SUITE_P(Crowds, NearPairs,
                         ::testing::Values(Course{1, 12, 1e-4, 2.0, 0.0, false, "Slow"},
                                           Course{2, 12, 5e-3, 2.0, 0.0, false, "Fast"},
                                           Course{3, 12, 2e-3, 0.0, 0.0, false, "NothingTold"},
                                           Course{4, 30, 1e-3, 2.0, 0.0, false, "Many"},
                                           Course{5, 12, 1e-3, 2.0, 0.0, true, "PlaneCarried"},
                                           Course{6, 30, 2e-4, 2.0, 2e-3, false, "AllCarried"},
                                           Course{7, 12, 2e-4, 0.0, 2e-3, true, "AllCarriedNothingTold"}),
                         [](const auto& course) { return course.param.name; });

TEST(World, SmallMotionsOfAListedPair_AreNotTestedUntilItMayTouch) {
  World world(testing::pair_of(Sphere{0.1}, Sphere{0.1}, kActivity));
  constexpr double kStep = 1e-4;
  const std::vector<double> reach(2, kStep);
  std::vector<Pose> poses{{}, {.position = {0.21, 0.0, 0.0}}};  // a gap of 10 mm
  int tests = 0, lists = 0, updates = 0;
  while (world.contacts().empty() && updates < 200) {
    const UpdateReport report = world.update(poses, reach);
    tests += report.narrow_tests;
    lists += report.box_tests > 0 ? 1 : 0;
    ++updates;
    poses[1].position.x() -= kStep;
  }
  // They touch when 10 mm less the two reaches have become the activity distance.
  EXPECT_NEAR(updates, 0.005 / kStep - 2.0 + 1.0, 2.0);
  EXPECT_LE(tests, 5);
  EXPECT_LE(lists, updates / 10);
}

TEST(World, ListedPairThatIsCarriedAlong_IsNotTestedAgain) {
  constexpr double kSpeed = 3e-3;
  World world(testing::pair_of(testing::box({0.1, 0.1, 0.1}), testing::box({0.1, 0.1, 0.1}), kActivity));
  const std::vector<Pose> beside{{}, {.position = {0.22, 0.0, 0.0}}};  // a gap of 20 mm
  const std::vector<double> reach(2, kSpeed);
  int tests = 0;
  for (int step = 0; step < 100; ++step) {
    const UpdateReport report = world.update(carried(carrier(kSpeed, step), beside), reach);
    ASSERT_EQ(report.status, UpdateStatus::kOk);
    tests += report.narrow_tests;
  }
  EXPECT_LE(tests, 2);
  EXPECT_TRUE(world.contacts().empty());
}

}  // namespace
}  // namespace layfigure::collision
