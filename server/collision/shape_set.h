#pragma once

#include <Eigen/Core>
#include <vector>

#include "layfigure/collision/world.h"
#include "polytope.h"
#include "separating_direction.h"

namespace layfigure::collision {

// Shapes as the tests use them, in the frame of the body that carries them. `shape` is the definition's index; `body`
// counts from the world, which is 0.
struct CoreShape {
  int shape;
  int body;
  Polytope core;
  ShrunkCore shrunk;
};
struct PlaneShape {
  int shape;
  int body;
  Eigen::Vector3d normal;
  double offset;
};

/// The shapes of a world, which stay as they are.
class ShapeSet {
 public:
  /// Cores that `like` has as the same shape under the same index are taken over.
  ShapeSet(WorldDefinition definition, const ShapeSet* like);

  [[nodiscard]] const WorldDefinition& definition() const { return definition_; }
  [[nodiscard]] const std::vector<CoreShape>& cores() const { return cores_; }
  [[nodiscard]] const std::vector<PlaneShape>& planes() const { return planes_; }

  [[nodiscard]] bool some_may_meet() const;
  [[nodiscard]] bool may_meet(int shape_a, int shape_b) const;
  /// Of each body's shapes about its origin, the world's first: infinite where one is a plane [m].
  [[nodiscard]] std::vector<double> radii() const;

 private:
  void add(const Sphere& shape, int index, const ShapeSet* like);
  void add(const Capsule& shape, int index, const ShapeSet* like);
  void add(const ConvexHull& shape, int index, const ShapeSet* like);
  void add(const Plane& shape, int index, const ShapeSet* like);
  void add_core(Polytope core, int index);
  [[nodiscard]] const Polytope* core_of(int index) const;

  WorldDefinition definition_;  ///< its excluded pairs sorted
  std::vector<CoreShape> cores_;
  std::vector<PlaneShape> planes_;
};

}  // namespace layfigure::collision
