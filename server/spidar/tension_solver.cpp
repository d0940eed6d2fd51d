#include "layfigure/spidar/tension_solver.h"

#include <string>

#include "box_problem.h"
#include "eight.h"
#include "layfigure/math/kernel.h"
#include "orthonormal.h"
#include "tension_polygon.h"

namespace layfigure::spidar {
namespace {

// Of the largest tension: so far beyond its range a tension may be for rounding.
constexpr double kRangeRounding = 1e-12;
// A wrench that is missed by this much at best cannot be had [N]: regularization takes a thousandth of it at most.
constexpr double kClearlyMissed = 1e-3;

/// The nearest tensions miss the wrench by more than what rounding or regularization does.
bool is_clearly_missed(const SixColumns& columns, const Eight& nearest, const Six& wanted) {
  const Six exerted = products(columns, nearest);
  double square = 0.0;
  for (int k = 0; k < 6; ++k) square += (exerted[k] - wanted[k]) * (exerted[k] - wanted[k]);
  return square > kClearlyMissed * kClearlyMissed;
}

/// The tensions nearest to the reference on every string that exert the wrench, in the range, if there are any; else
/// those outside of it.
struct ExactTensions {
  Eight t;
  bool in_range;

  ExactTensions(const SixColumns& columns, const Six& wanted, double reference, const Range& range) {
    const Orthonormal basis(columns);
    t = basis.shortest(wanted) + basis.without_wrench(all_eight(reference));
    in_range = basis.full_rank && is_within(t, range);
    if (in_range || !basis.full_rank) return;
    const Plane plane(basis);
    if (const auto z = TensionPolygon(t, plane, range, kRangeRounding * range.high).nearest()) {
      t = t + plane.x * z->x + plane.y * z->y;
      in_range = true;
    }
  }
};

}  // namespace

TensionSolver::TensionSolver(const Geometry& geometry, double reference)
    : strings_(std::make_unique<Strings>(geometry)),
      least_(geometry.least_tension),
      most_(geometry.most_tension),
      reference_(reference) {
  if (!(reference >= geometry.least_tension && reference <= geometry.most_tension)) {
    throw GeometryError("reference tension = " + std::to_string(reference) + " N, expected from " +
                        std::to_string(geometry.least_tension) + " to " + std::to_string(geometry.most_tension));
  }
}

TensionSolver::~TensionSolver() = default;

TensionSolution TensionSolver::solve(const Pose& pose, const Wrench& wrench) const {
  TensionSolution none;
  none.exact = true;
  return solve(pose, wrench, none);
}

LAYFIGURE_KERNEL
TensionSolution TensionSolver::solve(const Pose& pose, const Wrench& wrench, const TensionSolution& last) const {
  TensionSolution solution{.tensions = Tensions::Constant(reference_), .wrench = Wrench::Zero()};
  const SixColumns columns = straight_strings(*strings_, pose).wrenches;
  if (!wrench.allFinite() || !pose.position.allFinite() || !pose.rotation.coeffs().allFinite()) return solution;
  Six wanted;
  for (int k = 0; k < 6; ++k) wanted[k] = k < 3 ? wrench[k] : wrench[k] / strings_->grip_radius;

  // What could not be had in the last tick can seldom be had in this one.
  const Range range{least_, most_};
  Eight t;
  bool solved = false;
  if (!last.exact) {
    t = BoxProblem(columns, wanted, reference_, range).solve(load_eight(last.tensions), kMostPivots, solution.pivots);
    solved = is_clearly_missed(columns, t, wanted);
  }
  if (!solved) {
    const ExactTensions exact(columns, wanted, reference_, range);
    solution.exact = exact.in_range;
    if (solution.exact) {
      t = exact.t;
    } else if (last.exact) {
      t = BoxProblem(columns, wanted, reference_, range).solve(exact.t, kMostPivots, solution.pivots);
    }
  }

  store_eight(t, solution.tensions.data());
  solution.tensions = solution.tensions.cwiseMax(least_).cwiseMin(most_);
  const Six exerted = products(columns, load_eight(solution.tensions));
  for (int k = 0; k < 6; ++k) solution.wrench[k] = k < 3 ? exerted[k] : exerted[k] * strings_->grip_radius;
  return solution;
}

}  // namespace layfigure::spidar
