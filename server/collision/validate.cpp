#include "validate.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace layfigure::collision {
namespace {

constexpr double kUnitTolerance = 1e-6;

template <class Value>
[[noreturn]] void refuse(const std::string& what, const std::string& quantity, const Value& value,
                         const std::string& range) {
  std::ostringstream message;
  message << what << ": " << quantity << " = " << value << ", expected " << range;
  throw std::invalid_argument(message.str());
}

void require_length(const std::string& what, const std::string& quantity, double value) {
  if (!(value >= 0.0) || !std::isfinite(value)) refuse(what, quantity, value, "finite and >= 0");
}

/// Checks each kind of shape; `what` names it.
struct ShapeChecker {
  const std::string& what;

  void operator()(const Sphere& sphere) const { require_length(what, "radius", sphere.radius); }
  void operator()(const Capsule& capsule) const {
    require_length(what, "radius", capsule.radius);
    require_length(what, "half_length", capsule.half_length);
  }
  void operator()(const ConvexHull& hull) const {
    const auto count = hull.vertices.size();
    if (count < 1 || count > kMaxHullVertices) {
      refuse(what, "number of vertices", count, "1 to " + std::to_string(kMaxHullVertices));
    }
    for (std::size_t v = 0; v < count; ++v) {
      if (!hull.vertices[v].allFinite()) {
        refuse(what, "vertex " + std::to_string(v), hull.vertices[v].transpose(), "finite");
      }
    }
  }
  void operator()(const Plane&) const {}
};

void validate_shape(const ShapeDefinition& shape, int index, int bodies) {
  const std::string what = "shape '" + shape.name + "' (" + std::to_string(index) + ")";
  if (shape.body < kWorldBody || shape.body >= bodies) {
    refuse(what, "body", shape.body, "-1 (the world) to " + std::to_string(bodies - 1));
  }
  if (!is_rigid(shape.X_BS)) {
    std::ostringstream value;
    value << "[" << shape.X_BS.position.transpose() << "], [" << shape.X_BS.rotation.coeffs().transpose() << "]";
    refuse(what, "X_BS (position, quaternion x y z w)", value.str(), "finite, the quaternion unit");
  }
  require_length(what, "friction", shape.friction);
  std::visit(ShapeChecker{what}, shape.shape);
}

}  // namespace

bool is_rigid(const Pose& pose) {
  return pose.position.allFinite() && std::abs(pose.rotation.squaredNorm() - 1.0) <= 2.0 * kUnitTolerance;
}

void validate(const WorldDefinition& definition) {
  if (definition.bodies < 0) refuse("collision world", "bodies", definition.bodies, ">= 0");
  require_length("collision world", "activity", definition.activity);
  for (std::size_t i = 0; i < definition.shapes.size(); ++i) {
    validate_shape(definition.shapes[i], static_cast<int>(i), definition.bodies);
  }
  for (const auto& [a, b] : definition.excluded) {
    for (const int body : {a, b}) {
      if (body < kWorldBody || body >= definition.bodies) {
        refuse("excluded pair (" + std::to_string(a) + ", " + std::to_string(b) + ")", "body", body,
               "-1 (the world) to " + std::to_string(definition.bodies - 1));
      }
    }
  }
}

}  // namespace layfigure::collision
