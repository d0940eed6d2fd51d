// The LCM bridge with a device on the other side of a broker of its own.
#include <gtest/gtest.h>

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <layfigure/spidar_command_t.hpp>
#include <layfigure/spidar_state_t.hpp>
#include <mutex>
#include <thread>

#include "layfigure/device/open.h"
#include "layfigure/device/simulated_spidar.h"
#include "layfigure/messaging/broker.h"
#include "layfigure/messaging/bus.h"
#include "layfigure/spidar/geometry.h"
#include "sample_messages.h"

namespace layfigure::device {
namespace {

using messaging::Channel;

constexpr std::chrono::seconds kTimeout{20};  // never waited for in a test that passes

bool eventually(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + kTimeout;
  while (std::chrono::steady_clock::now() < deadline) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// The process of a device: collects commands, sends states.
class Peer {
 public:
  explicit Peer(const std::string& url)
      : bus_({url, ""}, {{Channel::kSpidarCommand, [this](messaging::ByteView bytes) { receive(bytes); }}}) {}

  void send(const spidar_state_t& state) { bus_.publish(Channel::kSpidarState, state); }
  std::vector<spidar_command_t> commands() {
    const std::lock_guard lock(mutex_);
    return commands_;
  }

 private:
  void receive(messaging::ByteView bytes) {
    spidar_command_t command{};
    if (command.decode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0) return;
    const std::lock_guard lock(mutex_);
    commands_.push_back(command);
  }

  std::mutex mutex_;
  std::vector<spidar_command_t> commands_;
  messaging::Bus bus_;
};

spidar_state_t pose_state(const std::string& id, std::int64_t sequence) {
  spidar_state_t state = testing::sample_spidar_state();
  state.device_id = id;
  state.sequence = sequence;
  return state;
}

std::unique_ptr<Driver> open_lcm_device(const std::string& url, const std::filesystem::path& config = {}) {
  return open_driver({.kind = "lcm", .config = config, .index = 0, .bus_url = url, .channel_prefix = ""});
}

/// Sends until the driver has something new: its subscription may not be known to the broker yet.
Reading read_after(Driver& driver, Peer& peer, spidar_state_t state) {
  Reading reading;
  EXPECT_TRUE(eventually([&] {
    peer.send(state);
    ++state.sequence;
    reading = driver.read(0.0);
    return reading.status != Reading::Status::kNothingNew;
  }));
  return reading;
}

TEST(LcmDriver, Pose_BecomesAReading) {
  messaging::Broker broker(0);
  const auto driver = open_lcm_device(broker.url());
  Peer peer(broker.url());
  EXPECT_EQ(driver->read(0.0).status, Reading::Status::kNothingNew);
  const Reading reading = read_after(*driver, peer, pose_state("0", 1));
  EXPECT_EQ(reading.status, Reading::Status::kOk);
  EXPECT_EQ(reading.position, Eigen::Vector3d(-0.5, -0.375, -0.25));
  EXPECT_EQ(reading.rotation.coeffs(), Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5).coeffs());
  EXPECT_EQ(reading.grip, 0.75);
  EXPECT_EQ(reading.buttons, 5U);
}

TEST(LcmDriver, OtherDevicesOldAndBadStates_AreNotRead) {
  messaging::Broker broker(0);
  const auto driver = open_lcm_device(broker.url());
  Peer peer(broker.url());
  (void)read_after(*driver, peer, pose_state("0", 1000));
  spidar_state_t bad = pose_state("0", 100'001);
  bad.rotation[0] = 3.0;
  peer.send(pose_state("other", 100'000));
  peer.send(bad);
  peer.send(pose_state("0", 999));
  spidar_state_t good = pose_state("0", 100'002);
  good.grip = 0.25;
  peer.send(good);
  Reading reading;
  double grip = 0.75;
  ASSERT_TRUE(eventually([&] {
    reading = driver->read(0.0);
    if (reading.status == Reading::Status::kOk) grip = reading.grip;
    return grip == 0.25;
  }));
  EXPECT_EQ(reading.status, Reading::Status::kOk);
}

TEST(LcmDriver, RejectedOrOfAnUnknownGeometry_Invalid) {
  messaging::Broker broker(0);
  const auto driver = open_lcm_device(broker.url());
  Peer peer(broker.url());
  spidar_state_t state = pose_state("0", 1);
  state.kind = messaging::kSpidarRejected;
  EXPECT_EQ(read_after(*driver, peer, state).status, Reading::Status::kInvalid);
  state = pose_state("0", 100'000);
  state.kind = messaging::kSpidarLengths;
  peer.send(state);
  ASSERT_TRUE(eventually([&] { return driver->read(0.0).status == Reading::Status::kInvalid; }));
}

TEST(LcmDriver, Wrench_ReachesTheDeviceAndCloseLetsGo) {
  messaging::Broker broker(0);
  auto driver = open_lcm_device(broker.url());
  Peer peer(broker.url());
  (void)read_after(*driver, peer, pose_state("0", 7));
  const Wrench wrench{.force = {1.0, -2.0, 1.5}, .torque = {0.01, 0.02, -0.03}};
  ASSERT_TRUE(eventually([&] {
    driver->write(wrench);
    return !peer.commands().empty();
  }));
  const spidar_command_t command = peer.commands().back();
  EXPECT_TRUE(command.active);
  EXPECT_EQ(command.device_id, "0");
  EXPECT_EQ(command.kind, 1);
  EXPECT_GE(command.state_sequence, 7);
  EXPECT_EQ(command.force[2], 1.5);
  EXPECT_EQ(command.torque[1], 0.02);
  driver->close();
  ASSERT_TRUE(eventually([&] { return !peer.commands().back().active; }));
  EXPECT_EQ(peer.commands().back().force[2], 0.0);
}

TEST(LcmDriver, Lengths_BecomeAPoseAndWrenchesTensions) {
  messaging::Broker broker(0);
  const std::filesystem::path config =
      std::filesystem::temp_directory_path() / ("layfigure-lcm-" + std::to_string(getpid()) + ".toml");
  std::ofstream(config) << "device_id = \"0\"\ngeometry = \"spidar-g6x3\"\n";
  const auto driver = open_lcm_device(broker.url(), config);
  std::filesystem::remove(config);
  Peer peer(broker.url());
  const spidar::Geometry geometry = spidar::load_geometry(LAYFIGURE_SPIDAR_FILES "/g6x3.toml");
  const Eigen::Vector3d position(0.01, -0.02, 0.005);
  const spidar::Pose pose = to_spidar(position, Eigen::Quaterniond::Identity());
  spidar_state_t state = pose_state("0", 1);
  state.kind = messaging::kSpidarLengths;
  Eigen::Map<spidar::Lengths>(state.lengths) = spidar::string_lengths(geometry, pose);
  const Reading reading = read_after(*driver, peer, state);
  EXPECT_EQ(reading.status, Reading::Status::kOk);
  EXPECT_LT((reading.position - position).norm(), 1e-8);
  const Wrench wrench{.force = {1.0, 2.0, -1.0}, .torque = {0.0, 0.01, 0.0}};
  ASSERT_TRUE(eventually([&] {
    driver->write(wrench);
    return !peer.commands().empty();
  }));
  const spidar_command_t command = peer.commands().back();
  EXPECT_EQ(command.kind, 0);
  const spidar::Wrench exerted =
      -spidar::length_jacobian(geometry, pose).transpose() * Eigen::Map<const spidar::Tensions>(command.tensions);
  EXPECT_LT((to_device(exerted).force - wrench.force).norm(), 1e-6);
  EXPECT_LT((to_device(exerted).torque - wrench.torque).norm(), 1e-8);
}

}  // namespace
}  // namespace layfigure::device
