#include "layfigure/spidar/calibration.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "layfigure/spidar/pose_solver.h"
#include "null_space.h"

namespace layfigure::spidar {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostSteps = 50;
constexpr double kConvergedStep = 1e-8;         // [m]: far below any encoder's count
constexpr double kWorstDeviation = 1e-3;        // [m]
constexpr double kRoundingVariance = 1.0 / 12;  // of a count
constexpr int kMotorNumbers = 3 * kStrings;
constexpr int kRigidMotions = 6;

std::string millimetres(double metres) {
  std::string text = std::to_string(1e3 * metres);
  return text + " mm";
}

/// Reduced normal equations for what the recordings share: the offsets, then the motors, string by string.
class Shared {
 public:
  Shared(const Geometry& start, std::span<const Recording> recordings, bool motors)
      : nominal_(start), recordings_(recordings), geometry_(start), count_(kStrings + (motors ? kMotorNumbers : 0)) {
    for (const Recording& recording : recordings) {
      equations_ += recording.pose ? kStrings : kStrings - 6;
      any_known_ = any_known_ || recording.pose.has_value();
    }
    poses_.resize(recordings.size());
  }

  [[nodiscard]] int spare_equations() const { return equations_ - count_ + (holds_frame() ? kRigidMotions : 0); }
  [[nodiscard]] const Geometry& geometry() const { return geometry_; }
  [[nodiscard]] const MatrixXd& normal() const { return normal_; }
  [[nodiscard]] bool with_motors() const { return count_ > kStrings; }
  [[nodiscard]] double sum_of_squares() const { return squares_; }
  [[nodiscard]] int equations() const { return equations_; }

  /// At the poses that fit the geometry as it is.
  void assemble() {
    normal_ = MatrixXd::Zero(count_, count_);
    right_ = VectorXd::Zero(count_);
    squares_ = 0.0;
    PoseSolver solver(geometry_);
    for (std::size_t k = 0; k < recordings_.size(); ++k) {
      const Lengths lengths = recordings_[k].told + geometry_.offsets;
      poses_[k] = recordings_[k].pose ? *recordings_[k].pose : pose_of(solver, lengths, k);
      add(recordings_[k], poses_[k], lengths);
    }
    if (holds_frame()) hold_frame();
  }

  /// Returns the step's largest number.
  double step() {
    const VectorXd step = normal_.ldlt().solve(right_);
    geometry_.offsets += step.head<kStrings>();
    for (int i = 0; with_motors() && i < kStrings; ++i) {
      geometry_.motors[i] += step.segment<3>(kStrings + 3 * i);
    }
    return step.cwiseAbs().maxCoeff();
  }

 private:
  [[nodiscard]] bool holds_frame() const { return with_motors() && !any_known_; }

  [[nodiscard]] static Pose pose_of(PoseSolver& solver, const Lengths& lengths, std::size_t k) {
    const PoseEstimate estimate = solver.solve(lengths);
    if (!estimate.converged) {
      throw CalibrationError(
          "recording " + std::to_string(k) +
          " fits no pose in the frame: home the device first, so that its offsets are roughly right");
    }
    return estimate.pose;
  }

  /// Residual L - (l + o); with respect to o it is -1, to a motor the unit vector of its string.
  void add(const Recording& recording, const Pose& pose, const Lengths& lengths) {
    const Lengths residual = string_lengths(geometry_, pose) - lengths;
    MatrixXd J = MatrixXd::Zero(kStrings, count_);
    J.leftCols<kStrings>() = -Eigen::Matrix<double, kStrings, kStrings>::Identity();
    for (int i = 0; with_motors() && i < kStrings; ++i) {
      const Eigen::Vector3d way = geometry_.motors[i] - pose.position - pose.rotation * geometry_.knots[i];
      J.block<1, 3>(i, kStrings + 3 * i) = way.normalized().transpose();
    }
    MatrixXd kept = J;
    VectorXd left = residual;
    if (!recording.pose) {
      const NullSpace N = null_space(scaled_wrench_matrix(geometry_, pose));
      kept = N.transpose() * J;
      left = N.transpose() * residual;
    }
    normal_ += kept.transpose() * kept;
    right_ -= kept.transpose() * left;
    squares_ += left.squaredNorm();
  }

  /// The motors' shifts have no part that is a motion of the frame.
  void hold_frame() {
    MatrixXd motion = MatrixXd::Zero(kRigidMotions, count_);
    VectorXd shift = VectorXd::Zero(count_);
    for (int i = 0; i < kStrings; ++i) {
      const Eigen::Vector3d& at = nominal_.motors[i];
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
        motion.block<1, 3>(axis, kStrings + 3 * i) = unit.transpose();
        motion.block<1, 3>(3 + axis, kStrings + 3 * i) = unit.cross(at).transpose() / at.norm();
      }
      shift.segment<3>(kStrings + 3 * i) = geometry_.motors[i] - at;
    }
    normal_ += motion.transpose() * motion;
    right_ -= motion.transpose() * (motion * shift);
  }

  const Geometry nominal_;
  std::span<const Recording> recordings_;
  Geometry geometry_;
  int count_;
  int equations_{0};
  bool any_known_{false};
  std::vector<Pose> poses_;
  MatrixXd normal_;
  VectorXd right_;
  double squares_{0.0};
};

void refuse_too_few(const Shared& shared, std::size_t recordings) {
  if (shared.spare_equations() >= 0) return;
  throw CalibrationError(std::to_string(recordings) + " recordings leave " + std::to_string(shared.equations()) +
                         " equations for " + std::to_string(shared.equations() - shared.spare_equations()) +
                         " numbers: record more poses");
}

/// The deviation of the least certain combination, for a variance of 1, is the inverse root of the least eigenvalue.
void refuse_undetermined(const Shared& shared) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(shared.normal());
  const double count = shared.geometry().metres_per_count;
  const double least = eigen.eigenvalues()[0];
  const double deviation = count * std::sqrt(kRoundingVariance / std::max(least, 1e-30));
  if (deviation <= kWorstDeviation) return;
  int number = 0;
  eigen.eigenvectors().col(0).cwiseAbs().maxCoeff(&number);
  const int string = number < kStrings ? number : (number - kStrings) / 3;
  throw CalibrationError(std::string("the recordings do not determine ") +
                         (number < kStrings ? "the offset" : "the motor") + " of string " + std::to_string(string) +
                         ": the encoders' rounding alone leaves " +
                         (deviation < 1.0 ? millimetres(deviation) : "it all") +
                         "; record poses that differ more, moved and turned about every axis");
}

double rms(const Shared& shared) { return std::sqrt(shared.sum_of_squares() / shared.equations()); }

}  // namespace

Lengths offsets_at(const Geometry& geometry, const Pose& pose, const Lengths& told) {
  return string_lengths(geometry, pose) - told;
}

Calibration calibrate(const Geometry& start, std::span<const Recording> recordings, bool motors) {
  for (std::size_t k = 0; k < recordings.size(); ++k) {
    const auto& pose = recordings[k].pose;
    if (recordings[k].told.allFinite() &&
        (!pose || (pose->position.allFinite() && pose->rotation.coeffs().allFinite()))) {
      continue;
    }
    throw CalibrationError("recording " + std::to_string(k) + " holds a number that is not finite: leave it out");
  }
  Shared shared(start, recordings, motors);
  refuse_too_few(shared, recordings.size());
  Calibration result;
  shared.assemble();
  refuse_undetermined(shared);
  result.residual_before = rms(shared);
  double step = INFINITY;
  while (!(step < kConvergedStep)) {
    if (++result.iterations > kMostSteps) {
      throw CalibrationError("the calibration does not settle (a step of " + millimetres(step) +
                             " is left): home the device first, or check that the geometry file is this device's");
    }
    step = shared.step();
    shared.assemble();
  }
  refuse_undetermined(shared);
  result.geometry = shared.geometry();
  result.residual = rms(shared);
  result.spare_equations = shared.spare_equations();
  const double variance = shared.sum_of_squares() / std::max(1, result.spare_equations);
  const VectorXd deviations =
      (variance * shared.normal().ldlt().solve(MatrixXd::Identity(shared.normal().rows(), shared.normal().cols())))
          .diagonal()
          .cwiseMax(0.0)
          .cwiseSqrt();
  result.offset_deviation = deviations.head<kStrings>();
  if (motors) result.motor_deviation = deviations.tail<kMotorNumbers>().maxCoeff();
  return result;
}

}  // namespace layfigure::spidar
