#pragma once

#include <optional>
#include <span>

#include "layfigure/spidar/geometry.h"

namespace layfigure::spidar {

/// What the encoders told at rest at one pose.
struct Recording {
  Lengths told;              ///< [m], without any offsets
  std::optional<Pose> pose;  ///< where it is known: a jig, another tracker
};

/// A calibration that the data does not allow. what() is one line that names what is missing and the mend.
class CalibrationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Offsets that make what the encoders tell at a known pose (homing: the grip in its rest) the lengths there.
[[nodiscard]] Lengths offsets_at(const Geometry& geometry, const Pose& pose, const Lengths& told);

struct Calibration {
  Geometry geometry;          ///< with the new offsets, and motors if asked for
  Lengths offset_deviation;   ///< standard deviation that the residual makes of each offset [m]
  double motor_deviation{0};  ///< largest of the motors' coordinates [m]; 0 if not asked for
  double residual_before{0};  ///< rms of a spare equation, with the offsets and motors as they were [m] ...
  double residual{0};         ///< ... and as they are: some counts at most, or the geometry is another one
  int spare_equations{0};     ///< that were not used up by what was found out
  int iterations{0};
};

/// Offsets, and the motors' positions if asked for, from many poses that need not be known. Eight lengths tell more
/// than the six numbers of a pose: each recording leaves two equations for what all share,
///     N_k^T (L(X_k, theta) - l_k - o) = 0,   N_k the null space of W at X_k
/// (variable projection: the poses X_k are found anew at every step). Least squares over all recordings by
/// Gauss-Newton steps, from `start` on, whose offsets are to be within some centimetres. A recording whose pose is
/// known gives all eight equations. Where none is known, the motors are found up to a motion of the frame as a whole,
/// which is left as it was.
///
/// Throws CalibrationError if a number is not finite, a recording fits no pose, there are too few recordings, or they
/// are so alike that the encoders' rounding alone would leave a number uncertain by more than a millimetre.
/// O(recordings) a step, milliseconds for hundreds. Allocates.
[[nodiscard]] Calibration calibrate(const Geometry& start, std::span<const Recording> recordings, bool motors = false);

}  // namespace layfigure::spidar
