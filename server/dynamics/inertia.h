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

inline PrincipalInertia principal_inertia(double mass, const Eigen::Matrix3d& inertia) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  PrincipalInertia principal{.moments = solver.eigenvalues().cwiseMax(kSmallestGyration * kSmallestGyration * mass),
                             .axes = solver.eigenvectors()};
  if (principal.axes.determinant() < 0.0) principal.axes.col(0) *= -1.0;
  return principal;
}

inline Eigen::Matrix3d inertia_matrix(const PrincipalInertia& inertia) {
  return inertia.axes * inertia.moments.asDiagonal() * inertia.axes.transpose();
}

/// I^-1 momentum of one in the body's axes: in the principal axes ...
inline Eigen::Vector3d principal_spin_of(const PrincipalInertia& inertia, const Eigen::Vector3d& momentum) {
  return (inertia.axes.transpose() * momentum).cwiseQuotient(inertia.moments);
}
/// ... and in the body's.
inline Eigen::Vector3d spin_of(const PrincipalInertia& inertia, const Eigen::Vector3d& momentum) {
  return inertia.axes * principal_spin_of(inertia, momentum);
}

}  // namespace layfigure::dynamics
