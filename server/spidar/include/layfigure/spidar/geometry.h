#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

/// SPIDAR-G devices: a grip on eight strings that run to motors on a frame. Encoders give the strings' lengths, the
/// motors' torques their tensions; strings only pull.
namespace layfigure::spidar {

inline constexpr int kStrings = 8;

template <class T>
using PerString = std::array<T, kStrings>;
using Lengths = Eigen::Matrix<double, kStrings, 1>;   ///< [m]
using Tensions = Eigen::Matrix<double, kStrings, 1>;  ///< [N], >= 0
using Wrench = Eigen::Matrix<double, 6, 1>;           ///< force [N] on the grip, then torque about its origin [N m]

/// Where the grip is in the device's frame D: X_DS, p_D = rotation p_S + position.
struct Pose {
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};  ///< [m]
};

/// A device that cannot be used. what() is one line that names the file, the value and the mend.
class GeometryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a device is like. D has its origin in the frame's middle; S is the grip's frame and is D when the grip is
/// centred.
struct Geometry {
  std::string name;
  PerString<Eigen::Vector3d> motors;  ///< a_i: where each string leaves its pulley, in D [m]
  PerString<Eigen::Vector3d> knots;   ///< b_i: where it is tied to the grip, in S [m]
  double metres_per_count{0.0};       ///< of the encoders, > 0
  double least_tension{0.0};          ///< that keeps a string from sagging [N], > 0
  double most_tension{0.0};           ///< that a motor holds [N], > least_tension
  Lengths offsets{Lengths::Zero()};   ///< to be added to what the encoders tell [m], see calibration.h

  /// Largest distance of a knot from the grip's origin [m]: what torques are measured by.
  [[nodiscard]] double grip_radius() const;
};

/// Lengths L_i = |a_i - p - R b_i| of straight strings.
[[nodiscard]] Lengths string_lengths(const Geometry& geometry, const Pose& pose);

/// dL = J (dp, dtheta), with dtheta a turn of the grip in D: row i is -(u_i, (R b_i) x u_i), u_i the unit vector from
/// knot to motor. The strings' wrench on the grip is W t with W = -J^T. O(1), no allocation.
[[nodiscard]] Eigen::Matrix<double, kStrings, 6> length_jacobian(const Geometry& geometry, const Pose& pose);

/// Some tensions, all above zero, exert no wrench, and the strings span all six directions: every wrench can then be
/// had, given tension enough.
[[nodiscard]] bool is_wrench_closed(const Geometry& geometry, const Pose& pose = {});

/// Throws GeometryError that names the value and the allowed range: numbers that are not finite, a motor where its knot
/// is, no wrench closure at the centre.
void validate(const Geometry& geometry);

/// Reads a TOML file:
///
///     name = "SPIDAR-G6X3"
///     metres_per_count = 16.66e-6
///     tension = [0.3, 20.0]        # least and most [N]
///     motors = [[-0.06, -0.076, 0.06], ..]   # eight, in the device's frame [m]
///     knots = [[-0.0159, 0.0, -0.0159], ..]  # of the same strings, in the grip's frame [m]
///     offsets = [0.001, ..]                  # eight, to be added to what the encoders tell [m]; 0 if left out
///
/// All other keys are needed, no others are allowed. Throws GeometryError with the file and the line; validate() is
/// called.
[[nodiscard]] Geometry load_geometry(const std::filesystem::path& path);

/// Of the text of such a file; `source` is what errors call it.
[[nodiscard]] Geometry parse_geometry(std::string_view text, const std::string& source);

}  // namespace layfigure::spidar
