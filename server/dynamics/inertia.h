#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "layfigure/dynamics/model.h"

namespace layfigure::dynamics {

/// Inertia of a body about its com, as it moves.
struct PrincipalInertia {
  Eigen::Vector3d moments;  ///< rising [kg m^2], at least those of kSmallestGyration
  Eigen::Matrix3d axes;     ///< R_BI: the principal axes as columns, right-handed
};

inline PrincipalInertia principal_inertia(const BodyDefinition& body) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(body.inertia);
  PrincipalInertia principal{
      .moments = solver.eigenvalues().cwiseMax(kSmallestGyration * kSmallestGyration * body.mass),
      .axes = solver.eigenvectors()};
  if (principal.axes.determinant() < 0.0) principal.axes.col(0) *= -1.0;
  return principal;
}

}  // namespace layfigure::dynamics
