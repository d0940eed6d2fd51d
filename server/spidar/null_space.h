#pragma once

#include <Eigen/Core>
#include <Eigen/QR>

#include "layfigure/spidar/geometry.h"

namespace layfigure::spidar {

/// Orthonormal columns that span the tensions without a wrench.
using NullSpace = Eigen::Matrix<double, kStrings, 2>;

/// W with its torques in units of the grip's radius, so that all its entries are of one size.
[[nodiscard]] inline Eigen::Matrix<double, 6, kStrings> scaled_wrench_matrix(const Geometry& geometry,
                                                                             const Pose& pose) {
  Eigen::Matrix<double, 6, kStrings> W = -length_jacobian(geometry, pose).transpose();
  W.bottomRows<3>() /= geometry.grip_radius();
  return W;
}

/// The last two columns of Q in W^T = Q R.
[[nodiscard]] inline NullSpace null_space(const Eigen::Matrix<double, 6, kStrings>& W) {
  const Eigen::HouseholderQR<Eigen::Matrix<double, kStrings, 6>> qr(W.transpose());
  const Eigen::Matrix<double, kStrings, kStrings> Q = qr.householderQ();
  return Q.rightCols<2>();
}

}  // namespace layfigure::spidar
