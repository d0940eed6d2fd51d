#include "layfigure/spidar/pose_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "cholesky.h"
#include "layfigure/math/kernel.h"
#include "layfigure/math/rotation.h"
#include "wrench_columns.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kConvergedStep = 1e-9;  // [m]: far below any encoder's count
// A step s from a misfit m, with factors of J^T J at a distance d, leaves one of about s (s + d + m) / L to make, L the
// string's length: so much the lengths curve. Times the inverse of the least singular value of the Jacobian, scaled by
// the grip's radius, where it is small.
constexpr double kCurvature = 10.0;
// Factors are good for another step while the grip is not further from where they were made [m]: what is left falls by
// a part of 30 and more each time, for half of what a step costs.
constexpr double kFactorReach = 1e-3;
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

using Factors = std::array<Six, 6>;

/// J^T J of a matrix J that is given by its columns, its lower triangle: 21 sums over the strings, four at a time.
Factors gram_matrix(const std::array<Eight, 6>& J) {
  constexpr int kSums = 24;
  Factors matrix{};
  std::array<double*, kSums> to;
  std::array<Eight, kSums> products;
  double spare = 0.0;
  int count = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      to[count] = &matrix[i][j];
      products[count++] = J[i] * J[j];
    }
  }
  for (; count < kSums; ++count) {
    to[count] = &spare;
    products[count] = products[0];
  }
  for (int first = 0; first < kSums; first += 4) {
    const math::Lanes4 sums = totals(products[first], products[first + 1], products[first + 2], products[first + 3]);
    for (int k = 0; k < 4; ++k) *to[first + k] = sums.v[k];
  }
  return matrix;
}

}  // namespace

PoseSolver::PoseSolver(const Geometry& geometry) : geometry_(geometry), strings_(std::make_unique<Strings>(geometry)) {}

PoseSolver::~PoseSolver() = default;

PoseEstimate PoseSolver::solve(const Lengths& lengths) {
  if (!lengths.allFinite()) return {.pose = pose_};
  PoseEstimate estimate;
  if (knows_pose_) estimate = refine(expected(), lengths, kWarmSteps, 0.0);
  const bool goes_on = estimate.converged;
  if (!goes_on) estimate = find(lengths);
  judge(lengths, estimate);
  if (estimate.converged) remember(estimate.pose, goes_on);
  return estimate;
}

void PoseSolver::remember(const Pose& pose, bool goes_on) {
  way_ = goes_on ? Vector3d(pose.position - pose_.position) : Vector3d::Zero();
  turn_ = goes_on ? pose.rotation * pose_.rotation.conjugate() : Eigen::Quaterniond::Identity();
  pose_ = pose;
  knows_pose_ = true;
}

/// Where the grip is if it goes on as it went between the last two poses.
Pose PoseSolver::expected() const { return {.rotation = turn_ * pose_.rotation, .position = pose_.position + way_}; }

/// The normal equations of the strings that count, J^T J x = J^T misfit; J is minus the wrenches' transpose. The misfit
/// that is left is taken straight on the last step.
LAYFIGURE_KERNEL
PoseEstimate PoseSolver::refine(const Pose& pose, const Lengths& lengths, int most_steps, double damping,
                                int without) const {
  PoseEstimate estimate{.pose = pose};
  const Eight told = load_eight(lengths);
  Tensions counted = Tensions::Ones();
  if (without != kNone) counted[without] = 0.0;
  const Eight counts = load_eight(counted);
  Factors factors;
  double distance = INFINITY;  // from where the factors were made
  while (estimate.iterations < most_steps) {
    StraightStrings now = straight_strings(*strings_, estimate.pose);
    for (Eight& column : now.wrenches) column = column * counts;
    const Eight misfit = (now.lengths - told) * counts;
    const double misfit_size = estimate.misfit = std::sqrt(total(misfit * misfit));
    if (damping > 0.0 || !(distance < kFactorReach)) {
      factors = gram_matrix(now.wrenches);
      for (int k = 0; k < 6; ++k) factors[k][k] *= 1.0 + damping * misfit_size / strings_->grip_radius;
      if (!factor<6>(factors)) return estimate;
      distance = 0.0;
    }
    Six step = products(now.wrenches, misfit);
    spidar::solve<6>(factors, step);
    ++estimate.iterations;
    const Vector3d move(step[0], step[1], step[2]);
    const Vector3d turn(step[3], step[4], step[5]);
    estimate.pose.position += move;
    estimate.pose.rotation = turned(estimate.pose.rotation, turn / strings_->grip_radius);
    const Eight left = misfit - combined(now.wrenches, step);
    estimate.misfit = std::sqrt(total(left * left));
    const double size = move.norm() + turn.norm();
    estimate.converged = size * (size + distance + misfit_size) * kCurvature < kConvergedStep * least(now.lengths);
    if (estimate.converged) break;
    distance += size;
  }
  return estimate;
}

/// The best of what the centre leads to, straight and turned about each axis: lengths may fit a pose beyond the frame
/// as well.
PoseEstimate PoseSolver::find(const Lengths& lengths) const {
  PoseEstimate best;
  double least = INFINITY;
  const auto attempt = [&](const Vector3d& turn) {
    const PoseEstimate estimate = refine({.rotation = math::exp_rotation(turn)}, lengths, kColdSteps, kColdDamping);
    const bool better = estimate.converged != best.converged ? estimate.converged : estimate.misfit < least;
    if (!better) return;
    best = estimate;
    least = estimate.misfit;
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
