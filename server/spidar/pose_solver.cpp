#include "layfigure/spidar/pose_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "layfigure/math/rotation.h"
#include "null_space.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kConvergedStep = 1e-9;  // [m]: far below any encoder's count
constexpr int kWarmSteps = 4;
constexpr int kColdSteps = 40;
constexpr double kColdDamping = 1e-3;  // of J^T J's diagonal, as it falls off with the misfit
constexpr double kColdTurn = 0.7;      // [rad] of the further starts
// Rounding leaves a misfit of sqrt(2 / 12) counts on average; this many are no accident.
constexpr double kSuspiciousCounts = 8.0;

}  // namespace

PoseSolver::PoseSolver(const Geometry& geometry) : geometry_(geometry), grip_radius_(geometry.grip_radius()) {}

PoseEstimate PoseSolver::solve(const Lengths& lengths) {
  if (!lengths.allFinite()) return {.pose = pose_};
  PoseEstimate estimate;
  if (knows_pose_) estimate = refine(pose_, lengths, kWarmSteps, 0.0);
  if (!estimate.converged) estimate = find(lengths);
  judge(lengths, estimate);
  if (estimate.converged) {
    pose_ = estimate.pose;
    knows_pose_ = true;
  }
  return estimate;
}

PoseEstimate PoseSolver::refine(Pose pose, const Lengths& lengths, int most_steps, double damping) const {
  PoseEstimate estimate{.pose = pose};
  while (estimate.iterations < most_steps) {
    Eigen::Matrix<double, kStrings, 6> J = length_jacobian(geometry_, estimate.pose);
    J.rightCols<3>() /= grip_radius_;
    const Lengths misfit = string_lengths(geometry_, estimate.pose) - lengths;
    Matrix6 normal = J.transpose() * J;
    normal.diagonal() *= 1.0 + damping * misfit.norm() / grip_radius_;
    const Eigen::LLT<Matrix6> factor(normal);
    if (factor.info() != Eigen::Success) return estimate;
    const Eigen::Matrix<double, 6, 1> step = -factor.solve(J.transpose() * misfit);
    ++estimate.iterations;
    estimate.pose.position += step.head<3>();
    estimate.pose.rotation = (math::exp_rotation(step.tail<3>() / grip_radius_) * estimate.pose.rotation).normalized();
    estimate.converged = step.head<3>().norm() + step.tail<3>().norm() < kConvergedStep;
    if (estimate.converged) break;
  }
  return estimate;
}

/// The best of what the centre leads to, straight and turned about each axis: lengths may fit a pose beyond the frame
/// as well.
PoseEstimate PoseSolver::find(const Lengths& lengths) const {
  PoseEstimate best;
  double least = INFINITY;
  const auto attempt = [&](const Vector3d& turn) {
    PoseEstimate estimate = refine({.rotation = math::exp_rotation(turn)}, lengths, kColdSteps, kColdDamping);
    const double misfit = (string_lengths(geometry_, estimate.pose) - lengths).norm();
    const bool better = estimate.converged != best.converged ? estimate.converged : misfit < least;
    if (!better) return;
    best = estimate;
    least = misfit;
  };
  attempt(Vector3d::Zero());
  const double good = kSuspiciousCounts * geometry_.metres_per_count;
  for (int axis = 0; axis < 3 && !(best.converged && least <= good); ++axis) {
    attempt(kColdTurn * Vector3d::Unit(axis));
    attempt(-kColdTurn * Vector3d::Unit(axis));
  }
  return best;
}

/// An error e in string i shows in the plane of the spare equations as e n_i, n_i row i of the null space of J^T.
void PoseSolver::judge(const Lengths& lengths, PoseEstimate& estimate) const {
  const Lengths misfit = string_lengths(geometry_, estimate.pose) - lengths;
  estimate.misfit = misfit.norm();
  estimate.suspicious = estimate.misfit > kSuspiciousCounts * geometry_.metres_per_count;
  if (!estimate.suspicious) return;
  const NullSpace N = null_space(scaled_wrench_matrix(geometry_, estimate.pose));
  const Eigen::Vector2d parity = N.transpose() * misfit;
  double best = -1.0;
  for (int i = 0; i < kStrings; ++i) {
    const double share = std::abs(N.row(i).normalized().dot(parity));
    if (share <= best) continue;
    best = share;
    estimate.suspect = i;
  }
}

Matrix6 pose_covariance(const Geometry& geometry, const Pose& pose) {
  const Eigen::Matrix<double, kStrings, 6> J = length_jacobian(geometry, pose);
  const double variance = geometry.metres_per_count * geometry.metres_per_count / 12.0;
  return variance * Matrix6(J.transpose() * J).llt().solve(Matrix6::Identity());
}

}  // namespace layfigure::spidar
