#include "contact_shape.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "layfigure/collision/world.h"
#include "layfigure/dynamics/state.h"

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

constexpr int kMostHullPoints = 32;      // contacts of a hull cost its edges
constexpr double kHullTolerance = 0.02;  // of the points' size: 6 mm of an adult's thigh
constexpr int kSubdivisions = 3;         // of the icosahedron: 642 directions, 8 degrees apart

/// Directions spread evenly: the corners of an icosahedron whose faces have been divided in four again and again.
std::vector<Vector3d> make_directions() {
  const double golden = 0.5 * (1.0 + std::sqrt(5.0));
  std::vector<Vector3d> points;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-golden, golden}) {
      points.insert(points.end(), {Vector3d(0.0, a, b), Vector3d(a, b, 0.0), Vector3d(b, 0.0, a)});
    }
  }
  std::vector<std::pair<int, int>> edges;
  double length = 2.0;  // of its edges
  const auto find_edges = [&] {
    edges.clear();
    for (int i = 0; i < static_cast<int>(points.size()); ++i) {
      for (int j = i + 1; j < static_cast<int>(points.size()); ++j) {
        if ((points[i] - points[j]).norm() < 1.3 * length) edges.emplace_back(i, j);
      }
    }
  };
  const double radius = points.front().norm();
  for (int k = 0; k < kSubdivisions; ++k) {
    find_edges();
    for (const auto& [i, j] : edges) points.push_back(radius * (points[i] + points[j]).normalized());
    length *= 0.5;
  }
  for (Vector3d& point : points) point.normalize();
  return points;
}

const std::vector<Vector3d>& directions() {
  static const std::vector<Vector3d> all = make_directions();
  return all;
}

/// Of each direction the point that is furthest along it.
std::vector<int> support_points(const std::vector<Vector3d>& points) {
  std::vector<int> support;
  for (const Vector3d& n : directions()) {
    int best = 0;
    for (int i = 1; i < static_cast<int>(points.size()); ++i) {
      if (n.dot(points[i]) > n.dot(points[best])) best = i;
    }
    support.push_back(best);
  }
  return support;
}

double size_of(const std::vector<Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  return box.diagonal().norm();
}

collision::ShapeDefinition named_shape(collision::Shape shape) {
  collision::ShapeDefinition definition;
  definition.shape = std::move(shape);
  return definition;
}

}  // namespace

std::vector<int> hull_points(const std::vector<Vector3d>& points, double tolerance, int most) {
  const std::vector<Vector3d>& normals = directions();
  const std::vector<int> support = support_points(points);
  std::vector<double> reached(normals.size(), -std::numeric_limits<double>::infinity());
  std::vector<int> chosen;
  std::size_t next = 0;
  while (static_cast<int>(chosen.size()) < most) {
    chosen.push_back(support[next]);
    double missed = 0.0;
    for (std::size_t k = 0; k < normals.size(); ++k) {
      reached[k] = std::max(reached[k], normals[k].dot(points[chosen.back()]));
      const double gap = normals[k].dot(points[support[k]]) - reached[k];
      if (gap <= missed) continue;
      missed = gap;
      next = k;
    }
    if (missed <= tolerance) break;
  }
  return chosen;
}

collision::ShapeDefinition make_hull(const std::vector<Vector3d>& points) {
  collision::ConvexHull hull;
  for (const int index : hull_points(points, kHullTolerance * size_of(points), kMostHullPoints)) {
    hull.vertices.push_back(points[index]);
  }
  return named_shape(hull);
}

collision::ShapeDefinition make_capsule(const std::vector<Vector3d>& points, const dynamics::BodyDefinition& body) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(body.inertia);
  const Vector3d axis = principal.eigenvectors().col(0);  // of the smallest moment
  const double radius = std::sqrt(2.0 * std::max(principal.eigenvalues()[0], 0.0) / body.mass);
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const Vector3d& p : points) {
    low = std::min(low, axis.dot(p - body.com));
    high = std::max(high, axis.dot(p - body.com));
  }
  collision::ShapeDefinition shape =
      named_shape(collision::Capsule{.radius = radius, .half_length = std::max(0.5 * (high - low) - radius, 0.0)});
  shape.X_BS.position = body.com + 0.5 * (low + high) * axis;
  shape.X_BS.rotation = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis);
  return shape;
}

std::vector<std::pair<int, int>> overlapping_at_rest(const dynamics::ModelDefinition& definition,
                                                     const std::vector<collision::ShapeDefinition>& shapes) {
  collision::WorldDefinition world;
  world.bodies = static_cast<int>(definition.bodies.size());
  world.shapes = shapes;
  world.activity = 0.0;
  for (int i = 0; i < world.bodies; ++i) {
    if (definition.bodies[i].parent >= 0) world.excluded.emplace_back(definition.bodies[i].parent, i);
  }
  const dynamics::Model model(definition);
  std::vector<dynamics::BodyPose> poses;
  world_poses(model, initial_state(model), poses);
  std::vector<collision::Pose> X_WB;
  for (const dynamics::BodyPose& pose : poses) X_WB.push_back({pose.rotation, pose.origin});
  collision::World all(world);
  (void)all.update(X_WB);
  std::set<std::pair<int, int>> pairs;
  for (const collision::ContactPoint& point : all.contacts()) {
    if (point.body_a == collision::kWorldBody || point.body_b == collision::kWorldBody) continue;
    pairs.insert(std::minmax(point.body_a, point.body_b));
  }
  return {pairs.begin(), pairs.end()};
}

}  // namespace layfigure::doll
