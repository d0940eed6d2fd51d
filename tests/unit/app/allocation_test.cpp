#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "allocation_count.h"
#include "layfigure/app/session_log.h"
#include "layfigure/app/simulation.h"
#include "layfigure/device/open.h"
#include "small_doll.h"

namespace layfigure::app {
namespace {

TEST(Advance, WithTwoGlidingGrips_DoesNotAllocate) {
  Simulation simulation(testing::small_doll(), {.clock = ClockKind::kLockstep});
  for (int id = 0; id < 2; ++id) {
    const Eigen::Vector3d held = simulation.grab({.pointer = id, .bone = 1 + id, .holds_rotation = true});
    simulation.point(id, {held + Eigen::Vector3d(0, 0, 0.1), Eigen::Quaterniond::Identity()}, "test", 1);
  }
  simulation.begin_motion(500);
  ASSERT_TRUE(simulation.advance());  // the first step with so many couplings may make room for them
  const long before = testing::allocation_count();
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(simulation.advance());
  EXPECT_EQ(testing::allocation_count(), before);
}

class LoggedAdvance : public ::testing::TestWithParam<int> {};  // ticks of the device in a step

TEST_P(LoggedAdvance, WithADevice_DoesNotAllocate) {
  std::vector<device::Device> devices;
  devices.push_back(device::open_device({.kind = "spidar-g6"}));
  Simulation simulation(testing::small_doll(), {.haptic_ticks = GetParam(), .clock = ClockKind::kLockstep},
                        haptics::DeviceHands(std::move(devices)));
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("layfigure-allocation-" + std::to_string(getpid()) + ".lcmlog");
  SessionLog log(path, "");
  std::filesystem::remove(path);  // it is there until it is closed
  int logged = 0;
  simulation.log_devices([&](const haptics::DeviceInput& input) {
    log.brought(input, simulation);
    ++logged;
  });
  const Eigen::Vector3d held = simulation.grab({.pointer = 0, .bone = 2});
  simulation.point(0, {held + Eigen::Vector3d(0, 0, 0.05), Eigen::Quaterniond::Identity()}, "test", 1);
  simulation.begin_motion(500);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(simulation.advance());  // which may make room
  const long before = testing::thread_allocation_count();
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(simulation.advance());
  EXPECT_EQ(testing::thread_allocation_count(), before);
  EXPECT_EQ(logged, 2100);
}

INSTANTIATE_TEST_SUITE_P(Ticks, LoggedAdvance, ::testing::Values(1, 4));

}  // namespace
}  // namespace layfigure::app
