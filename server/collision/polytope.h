#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "layfigure/collision/shapes.h"

namespace layfigure::collision {

/// The half-space normal . x <= offset, and the polygon that bounds the core there.
struct Face {
  Eigen::Vector3d normal;  ///< unit, outward
  double offset;           ///< [m]
  std::vector<int> loop;   ///< vertices, counterclockwise seen from outside
};

/// A convex core, in the frame of the body that carries it, rounded by a radius. A sphere's core is one vertex, a
/// capsule's one edge, a flat hull's a polygon with a face on either side.
struct Polytope {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::pair<int, int>> edges;  ///< of a point: that vertex twice, so that every core has an edge
  std::vector<Face> faces;
  std::vector<std::vector<int>> vertex_faces;  ///< the faces about each vertex
  double radius{0.0};                          ///< [m]
  Eigen::Vector3d center;                      ///< the vertices' mean: inside the core [m]
  double size{0.0};                            ///< the largest distance of a vertex from the centre [m]
  Eigen::Vector3d box_center;                  ///< of the bounding box along the body's axes [m]
  Eigen::Vector3d box_half;                    ///< half its extents, radius included [m]
};

[[nodiscard]] Polytope make_polytope(const Sphere& sphere, const Pose& X_BS);
[[nodiscard]] Polytope make_polytope(const Capsule& capsule, const Pose& X_BS);
/// O(v^3) for v vertices.
[[nodiscard]] Polytope make_polytope(const ConvexHull& hull, const Pose& X_BS);

}  // namespace layfigure::collision
