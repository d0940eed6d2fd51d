#pragma once

#include <array>
#include <cstring>

#include "layfigure/math/lanes.h"
#include "layfigure/math/spatial.h"
#include "layfigure/spidar/geometry.h"

/// Arithmetic on one number for each of the eight strings at once, for the code that runs at every haptic tick.
namespace layfigure::spidar {

struct Eight {
  math::Lanes4 a, b;  ///< of strings 0 to 3 and 4 to 7
};

inline Eight all_eight(double value) { return {math::Lanes4(value), math::Lanes4(value)}; }
inline Eight operator+(const Eight& x, const Eight& y) { return {x.a + y.a, x.b + y.b}; }
inline Eight operator-(const Eight& x, const Eight& y) { return {x.a - y.a, x.b - y.b}; }
inline Eight operator*(const Eight& x, const Eight& y) { return {x.a * y.a, x.b * y.b}; }
inline Eight operator/(const Eight& x, const Eight& y) { return {x.a / y.a, x.b / y.b}; }
inline Eight operator*(const Eight& x, double s) { return x * all_eight(s); }

inline Eight square_root(const Eight& x) { return {math::square_root(x.a), math::square_root(x.b)}; }

/// Sum over the strings of each of four, in the order of the arguments.
inline math::Lanes4 totals(const Eight& p, const Eight& q, const Eight& r, const Eight& s) {
  const auto t = math::transposed(math::Quad<math::Lanes4>{p.a + p.b, q.a + q.b, r.a + r.b, s.a + s.b});
  return (t.a + t.b) + (t.c + t.d);
}
inline double total(const Eight& x) {
  const math::Lanes4 sum = x.a + x.b;
  return (sum.v[0] + sum.v[1]) + (sum.v[2] + sum.v[3]);
}

inline double least(const Eight& x) {
  const math::Lanes4 m = math::select(x.a < x.b, x.a, x.b);
  return std::min(std::min(m.v[0], m.v[1]), std::min(m.v[2], m.v[3]));
}
inline double most(const Eight& x) {
  const math::Lanes4 m = math::maximum(x.a, x.b);
  return std::max(std::max(m.v[0], m.v[1]), std::max(m.v[2], m.v[3]));
}

inline Eight load_eight(const double* from) {
  Eight x;
  std::memcpy(&x.a.v, from, sizeof x.a.v);
  std::memcpy(&x.b.v, from + 4, sizeof x.b.v);
  return x;
}
inline Eight load_eight(const Eigen::Matrix<double, kStrings, 1>& x) { return load_eight(x.data()); }
inline void store_eight(const Eight& x, double* to) {
  std::memcpy(to, &x.a.v, sizeof x.a.v);
  std::memcpy(to + 4, &x.b.v, sizeof x.b.v);
}

/// A device's motors and knots, string beside string.
struct Strings {
  explicit Strings(const Geometry& geometry) : grip_radius(geometry.grip_radius()) {
    const auto beside = [](const PerString<Eigen::Vector3d>& points, int axis) {
      std::array<double, kStrings> numbers;
      for (int i = 0; i < kStrings; ++i) numbers[i] = points[i][axis];
      return load_eight(numbers.data());
    };
    motors = {beside(geometry.motors, 0), beside(geometry.motors, 1), beside(geometry.motors, 2)};
    knots = {beside(geometry.knots, 0), beside(geometry.knots, 1), beside(geometry.knots, 2)};
  }

  math::Vec3<Eight> motors;
  math::Vec3<Eight> knots;
  double grip_radius;
};

/// Straight strings at a pose, and the columns of W^T = -J: what a unit of tension exerts, torques in units of the
/// grip's radius, so that all entries are of one size.
struct StraightStrings {
  Eight lengths;
  std::array<Eight, 6> wrenches;
};

inline StraightStrings straight_strings(const Strings& strings, const Pose& pose) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  const Eigen::Vector3d& p = pose.position;
  const auto turned = [&](int row) {
    return strings.knots.x * R(row, 0) + strings.knots.y * R(row, 1) + strings.knots.z * R(row, 2);
  };
  const math::Vec3<Eight> arm{turned(0), turned(1), turned(2)};
  const math::Vec3<Eight> way{strings.motors.x - all_eight(p.x()) - arm.x, strings.motors.y - all_eight(p.y()) - arm.y,
                              strings.motors.z - all_eight(p.z()) - arm.z};
  StraightStrings straight;
  straight.lengths = square_root(math::dot(way, way));
  const Eight inverse = all_eight(1.0) / straight.lengths;
  const math::Vec3<Eight> u = math::scaled(way, inverse);
  const math::Vec3<Eight> torque = math::scaled(math::cross(arm, u), 1.0 / strings.grip_radius);
  straight.wrenches = {u.x, u.y, u.z, torque.x, torque.y, torque.z};
  return straight;
}

}  // namespace layfigure::spidar
