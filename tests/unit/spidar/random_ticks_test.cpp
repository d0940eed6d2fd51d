// Random ticks of a pointer, none of which may fail: 1e6 in a test run, LAYFIGURE_SPIDAR_TICKS of them if that is set.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "devices.h"
#include "layfigure/spidar/pose_solver.h"
#include "layfigure/spidar/tension_solver.h"

namespace layfigure::spidar {
namespace {

constexpr double kReference = 2.0;  // [N]
// What the solver weighs torques, and the tensions' own size, by (tension_solver.h).
constexpr double kTorqueShare = 0.1;
constexpr double kRegularization = 1e-9;
constexpr double kDistance = 0.05;                       // [m] of the border that poses are sent back from
constexpr double kTurn = 60.0 * std::numbers::pi / 180;  // [rad]

long tick_count() {
  const char* text = std::getenv("LAYFIGURE_SPIDAR_TICKS");
  return text != nullptr ? static_cast<long>(std::atof(text)) : 1'000'000;
}

/// A pose that wanders by some millimetres and degrees a tick: faster than any hand.
Pose wander(test::Dice& dice, const Pose& pose) {
  Pose next = pose;
  next.position += dice.between(0.0, 2e-3) * dice.direction();
  next.rotation = (math::exp_rotation(dice.between(0.0, 0.03) * dice.direction()) * next.rotation).normalized();
  const bool inside =
      next.position.norm() < kDistance && next.rotation.angularDistance(Eigen::Quaterniond::Identity()) < kTurn;
  return inside ? next : pose;
}

/// By how much the first-order conditions of the tensions nearest to a wrench are missed [N].
double optimality_gap(const Geometry& geometry, const Pose& pose, const Tensions& t, const Wrench& wanted) {
  Eigen::Matrix<double, 6, kStrings> W = -length_jacobian(geometry, pose).transpose();
  Wrench w = wanted;
  W.bottomRows<3>() *= kTorqueShare / geometry.grip_radius();
  w.tail<3>() *= kTorqueShare / geometry.grip_radius();
  const Tensions gradient = W.transpose() * (W * t - w) + kRegularization * (t - Tensions::Constant(kReference));
  double gap = 0.0;
  for (int i = 0; i < kStrings; ++i) {
    const bool low = t[i] <= geometry.least_tension;
    const bool high = t[i] >= geometry.most_tension;
    gap = std::max(gap, low ? -gradient[i] : high ? gradient[i] : std::abs(gradient[i]));
  }
  return gap;
}

TEST(SpidarTicks, Random_NoneFails) {
  const Geometry geometry = test::device("g6x3");
  PoseSolver poses(geometry);
  const TensionSolver solver(geometry, kReference);
  test::Dice dice(77);
  Pose pose;
  TensionSolution solution;
  double exact_error = 0.0;
  double worst_gap = 0.0;
  long exact = 0;
  int most_pivots = 0;
  const long ticks = tick_count();
  for (long tick = 0; tick < ticks; ++tick) {
    pose = wander(dice, pose);
    const Lengths told =
        (string_lengths(geometry, pose) / geometry.metres_per_count).array().round() * geometry.metres_per_count;
    const PoseEstimate estimate = poses.solve(told);
    ASSERT_TRUE(estimate.converged && !estimate.suspicious) << "tick " << tick;
    // Twenty counts: the rounding's error is below one, times the condition of the strings at the border.
    ASSERT_LT((estimate.pose.position - pose.position).norm(), 20.0 * geometry.metres_per_count) << "tick " << tick;
    // Half of the wrenches can be had for sure, being those of tensions in the range.
    Wrench wanted = dice.wrench(40.0, 1.0);
    const bool possible = tick % 2 == 0;
    if (possible) {
      Tensions t;
      for (int i = 0; i < kStrings; ++i) t[i] = dice.between(geometry.least_tension, geometry.most_tension);
      wanted = -length_jacobian(geometry, estimate.pose).transpose() * t;
    }
    solution = solver.solve(estimate.pose, wanted, solution);
    ASSERT_TRUE(solution.exact || !possible) << "tick " << tick;
    ASSERT_GE(solution.tensions.minCoeff(), geometry.least_tension) << "tick " << tick;
    ASSERT_LE(solution.tensions.maxCoeff(), geometry.most_tension) << "tick " << tick;
    most_pivots = std::max(most_pivots, solution.pivots);
    if (solution.exact) {
      ++exact;
      exact_error = std::max(exact_error, (solution.wrench - wanted).norm());
    } else {
      worst_gap = std::max(worst_gap, optimality_gap(geometry, estimate.pose, solution.tensions, wanted));
    }
  }
  std::printf(
      "%ld ticks, %ld exact: largest wrench error %.1e N; of the others the largest optimality gap %.1e N, "
      "%d pivots\n",
      ticks, exact, exact_error, worst_gap, most_pivots);
  EXPECT_LE(exact_error, 1e-9);
  EXPECT_LE(worst_gap, 1e-9);
  EXPECT_LT(most_pivots, TensionSolver::kMostPivots);
}

}  // namespace
}  // namespace layfigure::spidar
