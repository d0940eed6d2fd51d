#include "layfigure/spidar/geometry.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <sstream>
#include <vector>

#include <toml++/toml.h>

#include "null_space.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;

/// Smallest singular value of W, torques in units of the grip's radius, below which a direction is missing: a string's
/// whole tension then gives a thousandth of itself.
constexpr double kLeastSpan = 1e-3;
/// Tensions of a string in the null space below this part of the largest count as none.
constexpr double kLeastShare = 1e-6;

std::string number(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

void require(bool holds, const std::string& what) {
  if (!holds) throw GeometryError(what);
}

Vector3d to_vector(const toml::node& node, const std::string& key) {
  const toml::array* numbers = node.as_array();
  require(numbers != nullptr && numbers->size() == 3, key + ": expected three numbers, x y z in metres");
  Vector3d vector;
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = (*numbers)[static_cast<std::size_t>(axis)].value<double>();
    require(value.has_value(), key + ": expected three numbers, x y z in metres");
    vector[axis] = *value;
  }
  return vector;
}

PerString<Vector3d> to_points(const toml::node& node, const std::string& key) {
  const toml::array* points = node.as_array();
  require(points != nullptr && points->size() == kStrings, key + ": expected eight points");
  PerString<Vector3d> result;
  for (std::size_t i = 0; i < kStrings; ++i) result[i] = to_vector((*points)[i], key + "[" + number(double(i)) + "]");
  return result;
}

double to_number(const toml::node& node, const std::string& key) {
  const auto value = node.value<double>();
  require(value.has_value(), key + ": expected a number");
  return *value;
}

void read_key(const std::string& key, const toml::node& node, Geometry& geometry) {
  if (key == "name") {
    const auto name = node.value<std::string>();
    require(name.has_value(), "name: expected a text");
    geometry.name = *name;
  } else if (key == "metres_per_count") {
    geometry.metres_per_count = to_number(node, key);
  } else if (key == "tension") {
    const toml::array* range = node.as_array();
    require(range != nullptr && range->size() == 2, "tension: expected [least, most] in newtons");
    geometry.least_tension = to_number((*range)[0], key);
    geometry.most_tension = to_number((*range)[1], key);
  } else if (key == "motors") {
    geometry.motors = to_points(node, key);
  } else if (key == "knots") {
    geometry.knots = to_points(node, key);
  } else if (key == "offsets") {
    const toml::array* offsets = node.as_array();
    require(offsets != nullptr && offsets->size() == kStrings, "offsets: expected eight numbers, in metres");
    for (std::size_t i = 0; i < kStrings; ++i) geometry.offsets[static_cast<int>(i)] = to_number((*offsets)[i], key);
  } else {
    throw GeometryError("unknown key '" + key +
                        "', expected name, metres_per_count, tension, motors, knots, "
                        "offsets");
  }
}

}  // namespace

double Geometry::grip_radius() const {
  double radius = 0.0;
  for (const Vector3d& knot : knots) radius = std::max(radius, knot.norm());
  return radius;
}

Lengths string_lengths(const Geometry& geometry, const Pose& pose) {
  Lengths lengths;
  for (int i = 0; i < kStrings; ++i) {
    lengths[i] = (geometry.motors[i] - pose.position - pose.rotation * geometry.knots[i]).norm();
  }
  return lengths;
}

Eigen::Matrix<double, kStrings, 6> length_jacobian(const Geometry& geometry, const Pose& pose) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  Eigen::Matrix<double, kStrings, 6> J;
  for (int i = 0; i < kStrings; ++i) {
    const Vector3d arm = R * geometry.knots[i];
    const Vector3d u = (geometry.motors[i] - pose.position - arm).normalized();
    J.row(i) << -u.transpose(), -arm.cross(u).transpose();
  }
  return J;
}

/// In the plane of the null space the strings are directions n_i: tensions N z are all positive for some z if and only
/// if the n_i lie within an open half-plane, so if the largest gap between neighbours is more than half a turn.
bool is_wrench_closed(const Geometry& geometry, const Pose& pose) {
  const Eigen::Matrix<double, 6, kStrings> W = scaled_wrench_matrix(geometry, pose);
  const Eigen::JacobiSVD<Eigen::Matrix<double, 6, kStrings>> svd(W);
  if (!(svd.singularValues()[5] > kLeastSpan)) return false;
  const NullSpace N = null_space(W);
  std::vector<double> angles;
  for (int i = 0; i < kStrings; ++i) {
    if (!(N.row(i).norm() > kLeastShare)) return false;  // a string that no balance of tensions can use
    angles.push_back(std::atan2(N(i, 1), N(i, 0)));
  }
  std::sort(angles.begin(), angles.end());
  double gap = angles.front() + 2.0 * std::numbers::pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  return gap > std::numbers::pi * (1.0 + kLeastShare);
}

void validate(const Geometry& geometry) {
  for (int i = 0; i < kStrings; ++i) {
    const std::string string = "string " + std::to_string(i) + ": ";
    require(geometry.motors[i].allFinite() && geometry.knots[i].allFinite(),
            string + "its motor and knot must be finite");
    require((geometry.motors[i] - geometry.knots[i]).norm() > 0.0, string + "its motor is where its knot is");
  }
  require(geometry.offsets.allFinite(), "offsets: must be finite");
  require(geometry.metres_per_count > 0.0 && std::isfinite(geometry.metres_per_count),
          "metres_per_count = " + number(geometry.metres_per_count) + ", expected above 0");
  require(geometry.least_tension > 0.0 && std::isfinite(geometry.least_tension),
          "least tension = " + number(geometry.least_tension) + ", expected above 0");
  require(geometry.most_tension > geometry.least_tension && std::isfinite(geometry.most_tension),
          "most tension = " + number(geometry.most_tension) + ", expected above the least, " +
              number(geometry.least_tension));
  require(geometry.grip_radius() > 0.0, "knots: all are at the grip's origin, so that no torque can be had");
  require(is_wrench_closed(geometry),
          "its strings are not wrench-closed at the centre: pulling alone they cannot exert every force and torque; "
          "check the signs of its motors and knots");
}

Geometry parse_geometry(std::string_view text, const std::string& source) {
  const auto refuse = [&](const std::string& where, const std::string& why) {
    throw GeometryError(source + where + ": " + why);
  };
  Geometry geometry;
  try {
    const toml::table table = toml::parse(text);
    for (const auto& [key, node] : table) {
      try {
        read_key(std::string(key.str()), node, geometry);
      } catch (const GeometryError& error) {
        refuse(":" + std::to_string(node.source().begin.line), error.what());
      }
    }
    for (const char* key : {"name", "metres_per_count", "tension", "motors", "knots"}) {
      if (!table.contains(key)) refuse("", std::string("'") + key + "' is missing");
    }
  } catch (const toml::parse_error& error) {
    refuse(":" + std::to_string(error.source().begin.line), "not TOML: " + std::string(error.description()));
  }
  try {
    validate(geometry);
  } catch (const GeometryError& error) {
    refuse("", error.what());
  }
  return geometry;
}

Geometry load_geometry(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!std::filesystem::is_regular_file(path) || !file) {
    throw GeometryError(path.string() + ": there is no such geometry file; check the path");
  }
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return parse_geometry(text, path.string());
}

}  // namespace layfigure::spidar
