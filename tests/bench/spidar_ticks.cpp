#include "spidar_ticks.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "layfigure/math/rotation.h"
#include "layfigure/spidar/pose_solver.h"
#include "layfigure/spidar/tension_solver.h"

namespace layfigure::bench {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 1e-3;           // [s]
constexpr double kReferenceTension = 2.0;  // [N]
constexpr double kHandFrequency = 2.0;     // [Hz]
constexpr double kDistance = 0.03;         // [m]
constexpr double kTurn = std::numbers::pi / 6.0;
constexpr double kTorqueShare = 0.1;

/// Never the same twice: the frequencies have no common multiple.
Vector3d swing(double phase) { return {std::sin(phase), std::cos(1.1309 * phase), std::sin(0.8743 * phase + 1.0)}; }

spidar::Pose hand_at(double time) {
  const double phase = 2.0 * std::numbers::pi * kHandFrequency * time;
  return {.rotation = math::exp_rotation(kTurn / std::sqrt(3.0) * swing(0.7151 * phase + 2.0)),
          .position = kDistance / std::sqrt(3.0) * swing(phase)};
}

spidar::Wrench wrench_at(double time, double force, double grip_radius) {
  const double phase = 2.0 * std::numbers::pi * 1.618 * time;
  spidar::Wrench wrench;
  wrench << force / std::sqrt(3.0) * swing(phase),
      kTorqueShare * grip_radius * force / std::sqrt(3.0) * swing(1.37 * phase + 0.5);
  return wrench;
}

}  // namespace

SpidarTicks measure_spidar_ticks(const spidar::Geometry& geometry, int ticks, int passes, double force) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> times(ticks, std::numeric_limits<double>::infinity());
  SpidarTicks result{};
  const double radius = geometry.grip_radius();
  const spidar::TensionSolver tensions(geometry, kReferenceTension);
  for (int pass = 0; pass < passes; ++pass) {
    spidar::PoseSolver pose(geometry);
    (void)pose.solve(spidar::string_lengths(geometry, hand_at(0.0)));
    spidar::TensionSolution solution;
    solution.exact = true;
    int beyond = 0;
    for (int tick = 0; tick < ticks; ++tick) {
      const double time = kPeriod * (tick + 1);
      const double count = geometry.metres_per_count;
      const spidar::Lengths lengths = (spidar::string_lengths(geometry, hand_at(time)) / count).array().round() * count;
      const spidar::Wrench wanted = wrench_at(time, force, radius);
      const auto begin = Clock::now();
      const spidar::PoseEstimate estimate = pose.solve(lengths);
      solution = tensions.solve(estimate.pose, wanted, solution);
      const auto end = Clock::now();
      times[tick] = std::min(times[tick], std::chrono::duration<double, std::micro>(end - begin).count());
      result.most_pivots = std::max(result.most_pivots, solution.pivots);
      if (!solution.exact) {
        ++beyond;
        continue;
      }
      spidar::Wrench error = solution.wrench - wanted;
      error.tail<3>() /= radius;
      result.exact_error = std::max(result.exact_error, error.norm());
    }
    result.beyond_share = static_cast<double>(beyond) / ticks;
  }
  std::sort(times.begin(), times.end());
  result.median_us = times[times.size() / 2];
  result.p99_9_us = times[static_cast<std::size_t>(0.999 * static_cast<double>(times.size()))];
  result.most_us = times.back();
  return result;
}

}  // namespace layfigure::bench
