#pragma once

#include <memory>

#include "layfigure/spidar/geometry.h"

namespace layfigure::spidar {

struct Strings;

struct PoseEstimate {
  Pose pose;
  bool converged{false};   ///< what is left to go is below 1e-9 m, of position and of turn times the grip's radius
  int iterations{0};       ///< Gauss-Newton steps that were made
  double misfit{0.0};      ///< |L - l| over all strings [m], to 1e-9 m: two of the eight equations are spare
  bool suspicious{false};  ///< the misfit is too large for the encoders' rounding: slack, slip, or a wrong calibration
  int suspect{-1};         ///< the string without which the others fit best (where two are placed alike, one of
                           ///< them); -1: not suspicious
  double excess{0.0};      ///< by which the suspect's length is more than the other seven strings say [m]: above 0 it
                           ///< is slack or broken off its reel, below it slipped or its encoder is stuck; 0: no suspect
};

/// The grip's pose from the strings' lengths: Gauss-Newton on L_i(p, R) - l_i,
///     (dp, dtheta) = -(J^T J)^-1 J^T (L - l),   p <- p + dp,   R <- exp(dtheta) R
/// with dtheta scaled by the grip's radius, from where the grip is if it goes on as it went between the last two poses.
/// Two steps reach the encoders' floor at 1 kHz, the second with the factors of the first.
///
/// Not thread-safe; allocates nothing. The geometry must outlive it.
class PoseSolver {
 public:
  explicit PoseSolver(const Geometry& geometry);
  ~PoseSolver();

  /// Starts from the last poses that converged; from the centre, damped and from several turns if need be, where there
  /// is none or it leads nowhere: any pose in the frame that is turned by up to 60 degrees is then found, or
  /// `converged` is false. Lengths that are not finite are answered with the last pose, not converged. About
  /// 0.6 us from a near pose, some 10 us from none.
  [[nodiscard]] PoseEstimate solve(const Lengths& lengths);

  /// Forgets the last pose.
  void reset() { knows_pose_ = false; }

 private:
  static constexpr int kNone = -1;

  [[nodiscard]] PoseEstimate refine(const Pose& pose, const Lengths& lengths, int most_steps, double damping,
                                    int without = kNone) const;
  [[nodiscard]] PoseEstimate find(const Lengths& lengths) const;
  [[nodiscard]] Pose expected() const;
  void remember(const Pose& pose, bool goes_on);
  void judge(const Lengths& lengths, PoseEstimate& estimate) const;
  void find_suspect(const Lengths& lengths, PoseEstimate& estimate) const;

  const Geometry& geometry_;
  std::unique_ptr<const Strings> strings_;
  Pose pose_;
  Eigen::Vector3d way_{Eigen::Vector3d::Zero()};             ///< to it from the one before [m] ...
  Eigen::Quaterniond turn_{Eigen::Quaterniond::Identity()};  ///< ... and the turn, in D
  bool knows_pose_{false};
};

/// Covariance of (dp, dtheta) that the rounding of the encoders leaves, (Delta^2 / 12) (J^T J)^-1 with Delta the length
/// of a count [m^2, m rad, rad^2].
[[nodiscard]] Eigen::Matrix<double, 6, 6> pose_covariance(const Geometry& geometry, const Pose& pose);

}  // namespace layfigure::spidar
