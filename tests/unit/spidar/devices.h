#pragma once

#include <random>
#include <string>

#include "layfigure/math/rotation.h"
#include "layfigure/spidar/geometry.h"

namespace layfigure::spidar::test {

inline constexpr const char* kDevices[] = {"g6x3", "g6x4", "g6x5"};

inline std::string device_file(const std::string& name) { return LAYFIGURE_SPIDAR_FILES "/" + name + ".toml"; }
inline Geometry device(const std::string& name) { return load_geometry(device_file(name)); }

/// Numbers that are the same every time.
class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Eigen::Vector3d direction() {
    std::normal_distribution<double> normal;
    return Eigen::Vector3d(normal(random_), normal(random_), normal(random_)).normalized();
  }
  /// Up to so far from the centre [m], turned by up to so much [rad].
  Pose pose(double distance, double turn) {
    return {.rotation = math::exp_rotation(between(0.0, turn) * direction()),
            .position = between(0.0, distance) * direction()};
  }
  Wrench wrench(double force, double torque) {
    Wrench wrench;
    wrench << between(0.0, force) * direction(), between(0.0, torque) * direction();
    return wrench;
  }

 private:
  std::mt19937 random_;
};

}  // namespace layfigure::spidar::test
