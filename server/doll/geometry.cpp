#include "geometry.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace layfigure::doll {
namespace {

std::array<Eigen::Vector3d, 3> inertia_ellipsoid(const dynamics::BodyDefinition& body) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(body.inertia);
  const Eigen::Vector3d& moments = principal.eigenvalues();
  std::array<Eigen::Vector3d, 3> axes;
  for (int k = 0; k < 3; ++k) {
    const double spread = std::max(moments.sum() - 2.0 * moments[k], 0.0);  // rounding can leave it negative
    axes[k] = std::sqrt(2.5 * spread / body.mass) * principal.eigenvectors().col(k);
  }
  return axes;
}

BodyGeometry body_geometry(const Doll& doll, std::size_t body) {
  const Eigen::Isometry3d& X_WB = doll.rig.bones[doll.bone_of_body[body]].bind;
  BodyGeometry geometry;
  geometry.com = X_WB * doll.definition.bodies[body].com;
  geometry.semi_axes = inertia_ellipsoid(doll.definition.bodies[body]);
  for (Eigen::Vector3d& axis : geometry.semi_axes) axis = X_WB.linear() * axis;
  for (const Eigen::Vector3d& corner : doll.sections[body].outline) geometry.section.emplace_back(X_WB * corner);
  return geometry;
}

}  // namespace

Geometry make_geometry(const Doll& doll) {
  Geometry geometry;
  geometry.surface = make_surface(doll.rig);
  for (const int bone : triangle_owners(geometry.surface)) {
    geometry.body_of_triangle.push_back(bone < 0 ? -1 : doll.carriers[bone].body);
  }
  for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) geometry.bodies.push_back(body_geometry(doll, b));
  return geometry;
}

}  // namespace layfigure::doll
