#include "layfigure/spidar/workspace.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "null_space.h"

namespace layfigure::spidar {
namespace {

// Five strings whose wrenches span less than this leave no single normal.
constexpr double kLeastPivot = 1e-9;

using Vector6 = Eigen::Matrix<double, 6, 1>;

}  // namespace

Reach reach_at(const Geometry& geometry, const Pose& pose) {
  Reach reach;
  reach.wrench_closed = is_wrench_closed(geometry, pose);
  if (!reach.wrench_closed) return reach;
  const Eigen::Matrix<double, 6, kStrings> W = scaled_wrench_matrix(geometry, pose);
  reach.force = reach.wrench = INFINITY;
  const auto look_at = [&](const Vector6& normal) {
    double height = 0.0;
    for (int i = 0; i < kStrings; ++i) {
      const double along = normal.dot(W.col(i));
      height += along * (along > 0.0 ? geometry.most_tension : geometry.least_tension);
    }
    reach.wrench = std::min(reach.wrench, height);
    const double force_share = normal.head<3>().norm();
    if (force_share > 0.0) reach.force = std::min(reach.force, height / force_share);
  };
  for (int a = 0; a < kStrings; ++a) {
    for (int b = a + 1; b < kStrings; ++b) {
      for (int c = b + 1; c < kStrings; ++c) {
        Eigen::Matrix<double, 6, 5> five;
        int column = 0;
        for (int i = 0; i < kStrings; ++i) {
          if (i != a && i != b && i != c) five.col(column++) = W.col(i);
        }
        const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 6, 5>> qr(five);
        if (std::abs(qr.matrixR()(4, 4)) < kLeastPivot) continue;
        const Eigen::Matrix<double, 6, 6> Q = qr.householderQ();
        look_at(Q.col(5));
        look_at(-Q.col(5));
      }
    }
  }
  reach.force = std::max(reach.force, 0.0);
  reach.wrench = std::max(reach.wrench, 0.0);
  return reach;
}

}  // namespace layfigure::spidar
