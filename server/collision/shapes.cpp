#include "layfigure/collision/shapes.h"

#include <algorithm>

namespace layfigure::collision {
namespace {

struct Radius {
  double operator()(const Sphere& shape) const { return shape.radius; }
  double operator()(const Capsule& shape) const { return shape.radius + shape.half_length; }
  double operator()(const ConvexHull& shape) const {
    double radius = 0.0;
    for (const Eigen::Vector3d& vertex : shape.vertices) radius = std::max(radius, vertex.norm());
    return radius;
  }
  double operator()(const Plane&) const { return 0.0; }
};

}  // namespace

double radius_of(const Shape& shape) { return std::visit(Radius{}, shape); }

}  // namespace layfigure::collision
