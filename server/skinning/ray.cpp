#include "ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace layfigure::skinning {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Distances to a box's sides and the sheared coordinates of a triangle are off by a few units in the last place, and
/// so relative to the same lengths. With this much more room a box is entered wherever one of its triangles is met.
constexpr double kFarFactor = 1.0 + 16.0 * std::numeric_limits<double>::epsilon();

}  // namespace

Ray::Ray(const Vector3d& origin, const Vector3d& direction)
    : origin_(origin), direction_(direction), inverse_(direction.cwiseInverse()) {
  direction.cwiseAbs().maxCoeff(&z_);
  x_ = (z_ + 1) % 3;
  y_ = (x_ + 1) % 3;
  if (direction[z_] < 0.0) std::swap(x_, y_);  // keeps the triangles' winding
  shear_ = Vector3d(direction[x_], direction[y_], 1.0) / direction[z_];
}

Vector3d Ray::sheared(const Vector3d& p) const {
  const Vector3d from = p - origin_;
  return {from[x_] - shear_.x() * from[z_], from[y_] - shear_.y() * from[z_], shear_.z() * from[z_]};
}

std::optional<RayCrossing> Ray::cross(const Vector3d& a_W, const Vector3d& b_W, const Vector3d& c_W) const {
  const Vector3d a = sheared(a_W);
  const Vector3d b = sheared(b_W);
  const Vector3d c = sheared(c_W);
  // Of a shared edge both triangles compute the same products, so one's value is exactly the other's negative.
  const Vector3d areas(c.x() * b.y() - c.y() * b.x(), a.x() * c.y() - a.y() * c.x(), b.x() * a.y() - b.y() * a.x());
  if (areas.minCoeff() < 0.0 && areas.maxCoeff() > 0.0) return std::nullopt;
  const double sum = areas.sum();
  if (sum == 0.0) return std::nullopt;
  const Vector3d barycentric = areas / sum;
  const double distance = barycentric.dot(Vector3d(a.z(), b.z(), c.z()));
  if (!(distance >= 0.0)) return std::nullopt;
  return RayCrossing{distance, barycentric};
}

double Ray::enter(const Vector3d& low, const Vector3d& high) const {
  double near = 0.0;
  double far = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    // Along a side of the box a distance is 0 / 0, which max() and min() then leave out.
    const bool falls = std::signbit(inverse_[axis]);
    near = std::max(near, ((falls ? high : low)[axis] - origin_[axis]) * inverse_[axis]);
    far = std::min(far, ((falls ? low : high)[axis] - origin_[axis]) * inverse_[axis]);
  }
  return near <= far * kFarFactor ? near : kInfinity;
}

}  // namespace layfigure::skinning
