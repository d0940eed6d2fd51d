#pragma once

#include <memory>

#include "layfigure/spidar/geometry.h"

namespace layfigure::spidar {

struct Strings;

struct TensionSolution {
  Tensions tensions{Tensions::Zero()};  ///< within the device's range, always
  Wrench wrench{Wrench::Zero()};        ///< what they exert
  bool exact{false};                    ///< it is the wrench that was asked for, to rounding
  int pivots{0};                        ///< of the active set, where it was needed
};

/// Tensions that exert a wrench on the grip.
///
/// Where the device can, the wrench is exact: t = W^+ w + N z, with z in the plane of the tensions that exert nothing
/// chosen so that t is as near as can be to `reference` on every string while it stays in the range: the projection of
/// a point on a polygon of at most 16 edges, which is found by looking at each that the point is beyond.
/// Where it cannot, the wrench is the one nearest to what was asked for,
///     min |Lambda (W t - w)|^2 + e |t - reference|^2  in the range,
/// Lambda counting a torque as the force at the grip's radius that makes it, times a tenth: forces are kept first. e is
/// so small that it only picks among equals. A strictly convex problem in a box, solved by its active set: all strings
/// that are on the wrong side of a bound change at once as long as that gets on (block principal pivoting, Judice &
/// Pires 1994), then one at a time with the objective falling, which comes to an end by itself; kMostPivots bounds both
/// together. It begins with the strings that the exact wrench would take out of their range, or with those that were at
/// their bounds in the last tick: the answer is the same, sooner. After a tick that could not be exact it comes first,
/// and what it clearly misses is not asked for exactly. Both are continuous in the pose and the wrench, and meet at the
/// border.
///
/// Of a pose or a wrench that is not finite the answer is the reference. Thread-safe; allocates nothing. About 1 us,
/// half of that where the wrench is not exact, 6 at most, where the border is crossed.
class TensionSolver {
 public:
  static constexpr int kMostPivots = 64;

  /// `reference`: of every string where nothing is asked for [N], in the device's range.
  TensionSolver(const Geometry& geometry, double reference);
  ~TensionSolver();

  [[nodiscard]] TensionSolution solve(const Pose& pose, const Wrench& wrench) const;
  /// `last`: of the last tick.
  [[nodiscard]] TensionSolution solve(const Pose& pose, const Wrench& wrench, const TensionSolution& last) const;

 private:
  std::unique_ptr<const Strings> strings_;
  double least_;
  double most_;
  double reference_;
};

}  // namespace layfigure::spidar
