#include "layfigure/spidar/pose_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "cholesky.h"
#include "eight.h"
#include "layfigure/math/kernel.h"
#include "layfigure/math/rotation.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kConvergedStep = 1e-9;  // [m]: far below any encoder's count
// A step s from a misfit m leaves one of about s (s + m) / L to make, L the string's length: so much the lengths curve.
// Times the inverse of the least singular value of the Jacobian, scaled by the grip's radius, where it is small.
constexpr double kCurvature = 10.0;
constexpr int kWarmSteps = 6;
constexpr int kColdSteps = 40;
constexpr double kColdDamping = 1e-3;  // of J^T J's diagonal, as it falls off with the misfit
constexpr double kColdTurn = 0.7;      // [rad] of the further starts
// Rounding leaves a misfit of sqrt(2 / 12) counts on average; this many are no accident.
constexpr double kSuspiciousCounts = 8.0;

Eigen::Quaterniond turned(const Eigen::Quaterniond& rotation, const Vector3d& by) {
  const math::Quat<double> turn = math::exp_rotation(math::Vec3<double>{by.x(), by.y(), by.z()});
  return (Eigen::Quaterniond(turn.w, turn.x, turn.y, turn.z) * rotation).normalized();
}

struct NormalEquations {
  std::array<std::array<double, 6>, 6> matrix;  ///< its lower triangle
  std::array<double, 6> right;
};

/// J^T J and J^T r of a matrix J that is given by its columns: 27 sums over the strings, four at a time.
NormalEquations normal_equations(const std::array<Eight, 6>& J, const Eight& r) {
  NormalEquations normal;
  std::array<double*, 28> to;
  std::array<Eight, 28> products;
  int count = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      to[count] = &normal.matrix[i][j];
      products[count++] = J[i] * J[j];
    }
    to[count] = &normal.right[i];
    products[count++] = J[i] * r;
  }
  double spare = 0.0;
  to[count] = &spare;
  products[count] = products[0];
  for (int first = 0; first < 28; first += 4) {
    const math::Lanes4 sums = totals(products[first], products[first + 1], products[first + 2], products[first + 3]);
    for (int k = 0; k < 4; ++k) *to[first + k] = sums.v[k];
  }
  return normal;
}

}  // namespace

PoseSolver::PoseSolver(const Geometry& geometry) : geometry_(geometry), strings_(std::make_unique<Strings>(geometry)) {}

PoseSolver::~PoseSolver() = default;

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

/// The normal equations of the strings that count, J^T J x = J^T misfit; J is minus the wrenches' transpose.
LAYFIGURE_KERNEL
PoseEstimate PoseSolver::refine(const Pose& pose, const Lengths& lengths, int most_steps, double damping,
                                int without) const {
  PoseEstimate estimate{.pose = pose};
  const Eight told = load_eight(lengths);
  Tensions counted = Tensions::Ones();
  if (without != kNone) counted[without] = 0.0;
  const Eight counts = load_eight(counted);
  while (estimate.iterations < most_steps) {
    StraightStrings now = straight_strings(*strings_, estimate.pose);
    for (Eight& column : now.wrenches) column = column * counts;
    const Eight misfit = (now.lengths - told) * counts;
    const double misfit_size = std::sqrt(total(misfit * misfit));
    NormalEquations normal = normal_equations(now.wrenches, misfit);
    for (int k = 0; k < 6; ++k) normal.matrix[k][k] *= 1.0 + damping * misfit_size / strings_->grip_radius;
    if (!factor<6>(normal.matrix)) return estimate;
    spidar::solve<6>(normal.matrix, normal.right);
    ++estimate.iterations;
    const Vector3d move(normal.right[0], normal.right[1], normal.right[2]);
    const Vector3d turn(normal.right[3], normal.right[4], normal.right[5]);
    estimate.pose.position += move;
    estimate.pose.rotation = turned(estimate.pose.rotation, turn / strings_->grip_radius);
    const double step = move.norm() + turn.norm();
    estimate.converged = step * (step + misfit_size) * kCurvature < kConvergedStep * least(now.lengths);
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
    const double misfit = misfit_at(estimate.pose, lengths);
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

LAYFIGURE_KERNEL
double PoseSolver::misfit_at(const Pose& pose, const Lengths& lengths) const {
  const Eight misfit = straight_strings(*strings_, pose).lengths - load_eight(lengths);
  return std::sqrt(total(misfit * misfit));
}

void PoseSolver::judge(const Lengths& lengths, PoseEstimate& estimate) const {
  estimate.misfit = misfit_at(estimate.pose, lengths);
  estimate.suspicious = !(estimate.misfit <= kSuspiciousCounts * geometry_.metres_per_count);
  if (estimate.suspicious) find_suspect(lengths, estimate);
}

/// Seven strings still have a spare equation: without the one that is wrong it holds.
void PoseSolver::find_suspect(const Lengths& lengths, PoseEstimate& estimate) const {
  double least_misfit = INFINITY;
  for (int i = 0; i < kStrings; ++i) {
    const PoseEstimate others = refine(estimate.pose, lengths, kWarmSteps, 0.0, i);
    Lengths misfit = string_lengths(geometry_, others.pose) - lengths;
    const double excess = -misfit[i];
    misfit[i] = 0.0;
    if (!(misfit.norm() < least_misfit)) continue;
    least_misfit = misfit.norm();
    estimate.suspect = i;
    estimate.excess = excess;
  }
}

Matrix6 pose_covariance(const Geometry& geometry, const Pose& pose) {
  const Eigen::Matrix<double, kStrings, 6> J = length_jacobian(geometry, pose);
  const double variance = geometry.metres_per_count * geometry.metres_per_count / 12.0;
  return variance * Matrix6(J.transpose() * J).llt().solve(Matrix6::Identity());
}

}  // namespace layfigure::spidar
