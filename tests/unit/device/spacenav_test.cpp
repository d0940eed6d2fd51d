// The plugin for 3Dconnexion devices against a daemon of our own that speaks spacenavd's protocol.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "layfigure/device/check.h"
#include "layfigure/device/open.h"

namespace layfigure::device {
namespace {

namespace fs = std::filesystem;

constexpr std::int32_t kFullScale = 350;                // counts, see the plugin
constexpr double kSpeed = 0.2;                          // [m/s] at full deflection, unless its file says otherwise
constexpr double kTurnSpeed = 1.0;                      // [rad/s]
constexpr double kTick = 1e-3;                          // [s]
constexpr std::uint32_t kProtocolRequest = 0x7faa5500;  // and a version in the last byte

/// A spacenavd with one client, in the folder for temporary files: nothing of it needs root.
class Daemon {
 public:
  enum class Protocol { kOld, kNew };

  explicit Daemon(Protocol protocol = Protocol::kNew)
      : path_(fs::temp_directory_path() / ("layfigure-spnav-" + std::to_string(getpid()))), protocol_(protocol) {
    fs::remove(path_);
    listener_ = socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.string().copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    setenv("SPNAV_SOCKET", path_.c_str(), 1);
    thread_ = std::thread([this] { serve(); });
  }
  ~Daemon() {
    hang_up();
    shutdown(listener_, SHUT_RDWR);
    close(listener_);
    thread_.join();
    fs::remove(path_);
    unsetenv("SPNAV_SOCKET");
  }

  void motion(const std::array<std::int32_t, 6>& counts) {
    send({0, counts[0], counts[1], counts[2], counts[3], counts[4], counts[5], 8});
  }
  void button(std::int32_t number, bool down) { send({down ? 1 : 2, number, 0, 0, 0, 0, 0, 0}); }
  void hang_up() {
    if (client_ >= 0) shutdown(client_, SHUT_RDWR);
  }

 private:
  void send(const std::array<std::int32_t, 8>& event) {
    ASSERT_EQ(::send(client_, event.data(), sizeof event, MSG_NOSIGNAL), static_cast<ssize_t>(sizeof event));
  }

  /// Answers the request for the new protocol as spacenavd 1.x does; earlier ones take no notice.
  void serve() {
    int client = -1;
    while ((client = accept(listener_, nullptr, nullptr)) >= 0) {
      client_ = client;
      std::uint32_t request = 0;
      while (recv(client, &request, sizeof request, 0) > 0) {
        const bool is_request = (request & 0xffffff00U) == kProtocolRequest;
        if (is_request && protocol_ == Protocol::kNew) (void)::send(client, &request, sizeof request, MSG_NOSIGNAL);
      }
      client_ = -1;
      close(client);
    }
  }

  fs::path path_;
  Protocol protocol_;
  int listener_{-1};
  std::atomic<int> client_{-1};
  std::thread thread_;
};

OpenSettings spacenav(const fs::path& config = {}) {
  return {.kind = LAYFIGURE_SPACENAV, .config = config, .index = 0, .bus_url = {}, .channel_prefix = {}};
}

/// Reads at 1 kHz from `time` on for so long; the last reading.
Reading read_for(Driver& driver, double& time, double seconds) {
  Reading reading;
  for (int k = 0; k < std::lround(seconds / kTick); ++k) reading = driver.read(time += kTick);
  return reading;
}

TEST(Spacenav, PushedCap_MovesAtTheStatedSpeedAlongTheDevicesAxes) {
  for (const auto protocol : {Daemon::Protocol::kOld, Daemon::Protocol::kNew}) {
    Daemon daemon(protocol);
    const auto driver = open_driver(spacenav());
    double time = 50.0;
    (void)driver->read(time);
    // spacenavd: x right, y up, z away; the device's frame: x right, y away, z up.
    daemon.motion({kFullScale, kFullScale / 2, -kFullScale, 0, 0, 0});
    Reading reading = read_for(*driver, time, 0.5);
    EXPECT_EQ(reading.status, Reading::Status::kOk);
    EXPECT_LT((reading.position - 0.5 * kSpeed * Eigen::Vector3d(1.0, -1.0, 0.5)).norm(), 1e-9);
    EXPECT_EQ(reading.rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.0);
    daemon.motion({0, 0, 0, 0, 0, 0});
    const Eigen::Vector3d there = reading.position;
    reading = read_for(*driver, time, 0.5);
    EXPECT_EQ(reading.position, there) << "the cap let go, it stays";
    driver->close();
  }
}

TEST(Spacenav, TurnedCap_TurnsAtTheStatedSpeed) {
  Daemon daemon;
  const auto driver = open_driver(spacenav());
  double time = 0.0;
  (void)driver->read(time);
  daemon.motion({0, 0, 0, 0, kFullScale, 0});  // about what is up
  const Reading reading = read_for(*driver, time, 0.7);
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(0.7 * kTurnSpeed, Eigen::Vector3d::UnitZ()));
  EXPECT_LT(reading.rotation.angularDistance(expected), 1e-9);
  EXPECT_NEAR(reading.rotation.norm(), 1.0, 1e-12);
}

TEST(Spacenav, PushedForLong_StaysWithinReach) {
  Daemon daemon;
  const auto driver = open_driver(spacenav());
  double time = 0.0;
  (void)driver->read(time);
  daemon.motion({kFullScale, 0, 0, 0, 0, 0});
  EXPECT_NEAR(read_for(*driver, time, 10.0).position.norm(), driver->info().reach, 1e-9);
}

TEST(Spacenav, Buttons_AreTold) {
  Daemon daemon;
  const auto driver = open_driver(spacenav());
  double time = 0.0;
  (void)driver->read(time);
  daemon.button(0, true);
  daemon.button(3, true);
  Reading reading = read_for(*driver, time, 0.01);
  EXPECT_EQ(reading.buttons, 0b1001U);
  EXPECT_EQ(reading.grip, 1.0);
  daemon.button(0, false);
  reading = read_for(*driver, time, 0.01);
  EXPECT_EQ(reading.buttons, 0b1000U);
  EXPECT_EQ(reading.grip, 0.0);
}

TEST(Spacenav, DaemonThatGoes_IsTold) {
  Daemon daemon;
  const auto driver = open_driver(spacenav());
  double time = 0.0;
  (void)driver->read(time);
  daemon.hang_up();
  EXPECT_EQ(read_for(*driver, time, 0.01).status, Reading::Status::kGone);
}

TEST(Spacenav, ConfigFile_SetsTheGainsOrIsRefused) {
  Daemon daemon;
  const fs::path file = fs::temp_directory_path() / ("layfigure-spacenav-" + std::to_string(getpid()) + ".conf");
  const auto write = [&](const std::string& text) { std::ofstream(file) << text; };
  write("# slow\nspeed = 0.05\n\nreach = 0.01  # small\n");
  {
    const auto driver = open_driver(spacenav(file));
    double time = 0.0;
    (void)driver->read(time);
    daemon.motion({0, kFullScale, 0, 0, 0, 0});
    EXPECT_NEAR(read_for(*driver, time, 0.1).position.z(), 0.005, 1e-9);
    EXPECT_EQ(driver->info().reach, 0.01);
  }
  for (const char* bad :
       {"speed = fast\n", "speed = -1\n", "speed = nan\n", "gain = 3\n", "speed 3\n", "speed = 1 2\n"}) {
    write(std::string("reach = 1\n") + bad);
    try {
      (void)open_driver(spacenav(file));
      ADD_FAILURE() << bad;
    } catch (const DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find(":2: expected"), std::string::npos) << error.what();
    }
  }
  fs::remove(file);
  EXPECT_THROW((void)open_driver(spacenav(file)), DeviceError);
}

TEST(Spacenav, NoDaemonOrASecondDevice_RefusedInOneLine) {
  setenv("SPNAV_SOCKET", "/no/such/socket", 1);
  EXPECT_THROW((void)open_driver(spacenav()), DeviceError);
  Daemon daemon;
  const auto driver = open_driver(spacenav());
  try {
    (void)open_driver(spacenav());
    ADD_FAILURE();
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("open already"), std::string::npos) << error.what();
  }
}

TEST(Spacenav, Plugin_KeepsToTheRules) {
  Daemon daemon;
  std::string failed;
  EXPECT_TRUE(check_device([&] { return open_driver(spacenav()); }, {.seconds = 0.3},
                           [&](const CheckLine& line) {
                             if (line.result == CheckLine::Result::kFailed) failed += line.what + "\n";
                           }))
      << failed;
}

}  // namespace
}  // namespace layfigure::device
