#include "layfigure/app/pose_publisher.h"

#include <gtest/gtest.h>

#include "recording_sink.h"
#include "small_doll.h"

namespace layfigure::app {
namespace {

struct Fixture {
  Fixture(double physics_hz, double pose_hz)
      : simulation(testing::small_doll(),
                   {.physics_hz = physics_hz, .pose_hz = pose_hz, .clock = ClockKind::kLockstep}),
        poses(simulation, sink, 77) {
    poses.publish_if_due();
  }

  void run(int steps) {
    for (int i = 0; i < steps; ++i) {
      ASSERT_TRUE(simulation.advance());
      poses.publish_if_due();
    }
  }

  [[nodiscard]] std::vector<std::int64_t> steps_of_poses() const {
    std::vector<std::int64_t> steps;
    for (const pose_t& pose : sink.poses) steps.push_back(pose.step);
    return steps;
  }

  Simulation simulation;
  RecordingSink sink;
  PosePublisher poses;
};

TEST(PosePublisher, AtTheStart_PublishesTheInitialPose) {
  const Fixture fixture(1000, 60);
  ASSERT_EQ(fixture.sink.poses.size(), 1U);
  const pose_t& pose = fixture.sink.poses[0];
  EXPECT_EQ(pose.time_us, 0);
  EXPECT_EQ(pose.sequence, 0);
  EXPECT_EQ(pose.server_id, 77);
  EXPECT_EQ(pose.joint_count, 4);
}

TEST(PosePublisher, OutOfTurn_TakesItsPlaceAndTheRateGoesOn) {
  Fixture fixture(1000, 60);
  fixture.run(20);
  fixture.poses.publish();
  fixture.poses.publish();
  fixture.run(30);
  EXPECT_EQ(fixture.steps_of_poses(), (std::vector<std::int64_t>{0, 17, 20, 34, 50}));
  EXPECT_EQ(fixture.poses.count(), 5);
}

TEST(PosePublisher, RateThatDoesNotDivide_TakesTheFirstStepAtOrAfter) {
  Fixture fixture(1000, 60);
  fixture.run(100);
  EXPECT_EQ(fixture.steps_of_poses(), (std::vector<std::int64_t>{0, 17, 34, 50, 67, 84, 100}));
  EXPECT_EQ(fixture.sink.poses[1].time_us, 17000);
}

TEST(PosePublisher, SameRate_PublishesEveryStep) {
  Fixture fixture(240, 240);
  fixture.run(240);
  EXPECT_EQ(fixture.sink.poses.size(), 241U);
  EXPECT_EQ(fixture.sink.poses[1].time_us, 4167);
  EXPECT_EQ(fixture.sink.poses.back().time_us, 1000000);
}

TEST(PosePublisher, OneSecond_HasPoseHzPosesWithGaplessSequence) {
  Fixture fixture(1000, 60);
  fixture.run(1000);
  ASSERT_EQ(fixture.sink.poses.size(), 61U);
  for (std::size_t i = 0; i < 61; ++i) EXPECT_EQ(fixture.sink.poses[i].sequence, static_cast<std::int64_t>(i));
}

TEST(PosePublisher, RepeatNewest_SendsTheSameBytes) {
  Fixture fixture(1000, 60);
  fixture.run(20);
  fixture.poses.repeat_newest();
  ASSERT_EQ(fixture.sink.poses.size(), 3U);
  EXPECT_EQ(messaging::encode(fixture.sink.poses[1]), messaging::encode(fixture.sink.poses[2]));
  EXPECT_EQ(fixture.poses.count(), 2);
}

TEST(PosePublisher, EveryPointer_HasAForceWithEachPose) {
  Fixture fixture(1000, 1000);
  fixture.run(1);
  EXPECT_TRUE(fixture.sink.forces.empty());
  fixture.simulation.grab({.pointer = 2, .bone = 2});
  fixture.simulation.point(5, {{1, 2, 3}, Eigen::Quaterniond::Identity()}, "test", 1);
  fixture.run(1);
  ASSERT_EQ(fixture.sink.forces.size(), 2U);
  EXPECT_EQ(fixture.sink.forces[0].pointer, 2);
  EXPECT_TRUE(fixture.sink.forces[0].attached);
  EXPECT_EQ(fixture.sink.forces[0].joint, 2);
  EXPECT_EQ(fixture.sink.forces[0].sequence, fixture.sink.poses.back().sequence);
  EXPECT_EQ(fixture.sink.forces[1].pointer, 5);
  EXPECT_FALSE(fixture.sink.forces[1].attached);
  EXPECT_EQ(fixture.sink.forces[1].joint, -1);
  EXPECT_EQ(fixture.sink.forces[1].position[1], 2.0);
}

}  // namespace
}  // namespace layfigure::app
