#include "layfigure/spidar/pose_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "layfigure/math/rotation.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kConvergedStep = 1e-9;  // [m]: far below any encoder's count
constexpr int kWarmSteps = 6;
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

PoseEstimate PoseSolver::refine(const Pose& pose, const Lengths& lengths, int most_steps, double damping,
                                int without) const {
  PoseEstimate estimate{.pose = pose};
  while (estimate.iterations < most_steps) {
    Eigen::Matrix<double, kStrings, 6> J = length_jacobian(geometry_, estimate.pose);
    J.rightCols<3>() /= grip_radius_;
    Lengths misfit = string_lengths(geometry_, estimate.pose) - lengths;
    if (without != kNone) {
      J.row(without).setZero();
      misfit[without] = 0.0;
    }
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

void PoseSolver::judge(const Lengths& lengths, PoseEstimate& estimate) const {
  estimate.misfit = (string_lengths(geometry_, estimate.pose) - lengths).norm();
  estimate.suspicious = !(estimate.misfit <= kSuspiciousCounts * geometry_.metres_per_count);
  if (estimate.suspicious) estimate.suspect = find_suspect(estimate.pose, lengths);
}

/// Seven strings still have a spare equation: without the one that is wrong it holds.
int PoseSolver::find_suspect(const Pose& pose, const Lengths& lengths) const {
  int suspect = kNone;
  double least = INFINITY;
  for (int i = 0; i < kStrings; ++i) {
    const PoseEstimate others = refine(pose, lengths, kWarmSteps, 0.0, i);
    Lengths misfit = string_lengths(geometry_, others.pose) - lengths;
    misfit[i] = 0.0;
    if (!(misfit.norm() < least)) continue;
    least = misfit.norm();
    suspect = i;
  }
  return suspect;
}

Matrix6 pose_covariance(const Geometry& geometry, const Pose& pose) {
  const Eigen::Matrix<double, kStrings, 6> J = length_jacobian(geometry, pose);
  const double variance = geometry.metres_per_count * geometry.metres_per_count / 12.0;
  return variance * Matrix6(J.transpose() * J).llt().solve(Matrix6::Identity());
}

}  // namespace layfigure::spidar
