// The device's rows: pose, tensions, walls.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "haptics.h"
#include "layfigure/math/rotation.h"
#include "layfigure/spidar/pose_solver.h"
#include "layfigure/spidar/tension_solver.h"
#include "spidar_chain.h"
#include "spidar_ticks.h"

namespace layfigure::bench {
namespace {

using Eigen::Vector3d;
using spidar::Pose;

constexpr double kPoseError = 1.2;     // over the encoders' floor
constexpr double kMedianTime = 2.0;    // [us]
constexpr double kTailTime = 8.0;      // [us]
constexpr double kWrenchError = 1e-9;  // [N]
constexpr double kIdealOverChain = 1.0 / 0.8;
constexpr double kReferenceTension = 1.0;  // [N]
constexpr double kRate = 1000.0;
// Over the same ticks: of a tick's times the least is its own, the others are those of the machine's interrupts too.
constexpr int kPasses = 5;
constexpr unsigned kSeed = 5;

spidar::Geometry device() { return spidar::load_geometry(LAYFIGURE_SPIDAR_FILES "/g6x3.toml"); }

/// A hand that moves fast all over the workspace: 0.4 m/s, 8 rad/s.
Pose fast_hand(double time) {
  const double phase = 2.0 * std::numbers::pi * time;
  const Vector3d turn(0.35 * std::sin(3.1 * phase), 0.3 * std::sin(2.3 * phase + 1.0), 0.3 * std::sin(2.7 * phase));
  const Vector3d way(std::sin(2.9 * phase), std::sin(2.1 * phase + 2.0), std::cos(2.5 * phase));
  return {.rotation = math::exp_rotation(turn), .position = 0.02 * way};
}

spidar::Lengths counted(const spidar::Geometry& geometry, const Pose& pose) {
  const double count = geometry.metres_per_count;
  return ((string_lengths(geometry, pose) / count).array().round() * count).matrix();
}

void tell_pose(const spidar::Geometry& geometry, long ticks, std::vector<Figure>& figures) {
  spidar::PoseSolver solver(geometry);
  double way = 0.0, turn = 0.0, floor_way = 0.0, floor_turn = 0.0;
  long lost = 0;
  for (long k = 0; k < ticks; ++k) {
    const Pose truth = fast_hand(static_cast<double>(k) / kRate);
    const auto found = solver.solve(counted(geometry, truth));
    if (!found.converged) ++lost;
    const auto covariance = pose_covariance(geometry, truth);
    way += (found.pose.position - truth.position).squaredNorm();
    const double angle = found.pose.rotation.angularDistance(truth.rotation);
    turn += angle * angle;
    floor_way += covariance.diagonal().head<3>().sum();
    floor_turn += covariance.diagonal().tail<3>().sum();
  }
  figures.push_back({"pose: position error / encoder floor, rms", std::sqrt(way / floor_way), "", kPoseError});
  figures.push_back({"pose: rotation error / encoder floor, rms", std::sqrt(turn / floor_turn), "", kPoseError});
  figures.push_back({"pose: ticks not converged", static_cast<double>(lost), "", 0.0});
}

void tell_times(const spidar::Geometry& geometry, int ticks, std::vector<Figure>& figures) {
  struct Case {
    const char* name;
    double force;  ///< [N]
  };
  // Of the first wrench the device can do nearly all, of the second hardly any.
  constexpr Case kCases[] = {{"pose and tensions", 5.0}, {"pose and tensions beyond what can be had", 60.0}};
  for (const auto& [name, force] : kCases) {
    const std::string ticked(name);
    const SpidarTicks least = measure_spidar_ticks(geometry, ticks, kPasses, force);
    figures.push_back({ticked + ", median", least.median_us, "us", kMedianTime});
    figures.push_back({ticked + ", p99.9", least.p99_9_us, "us", kTailTime});
    figures.push_back({ticked + ": wrench error where exact, most", least.exact_error, "N", kWrenchError});
  }
  const SpidarTicks once = measure_spidar_ticks(geometry, ticks, 1, kCases[0].force);
  figures.push_back({"pose and tensions, in one pass with the machine's interrupts, p99.9", once.p99_9_us, "us"});
}

void tell_wrenches(const spidar::Geometry& geometry, long count, std::vector<Figure>& figures) {
  const spidar::TensionSolver solver(geometry, kReferenceTension);
  std::mt19937 random(kSeed);
  std::normal_distribution<double> normal;
  const auto vector = [&](double size) -> Vector3d {
    return size / 3.0 * Vector3d(normal(random), normal(random), normal(random));
  };
  double worst = 0.0;
  long exact = 0;
  long failed = 0;
  for (long k = 0; k < count; ++k) {
    const Pose pose{.rotation = math::exp_rotation(vector(0.6)), .position = vector(0.03)};
    spidar::Wrench wrench;
    wrench << vector(10.0), vector(0.2);
    const auto found = solver.solve(pose, wrench);
    const auto& t = found.tensions;
    if (!t.allFinite() || t.minCoeff() < geometry.least_tension || t.maxCoeff() > geometry.most_tension) ++failed;
    if (!found.exact) continue;
    ++exact;
    const spidar::Wrench exerted = -length_jacobian(geometry, pose).transpose() * t;
    worst = std::max(worst, (exerted - wrench).head<3>().norm());
  }
  const std::string name = "wrenches, " + std::to_string(count) + " at random: ";
  figures.push_back({name + "error where feasible, most", worst, "N", kWrenchError});
  figures.push_back({name + "failures", static_cast<double>(failed), "", 0.0});
  figures.push_back({name + "share feasible", static_cast<double>(exact) / static_cast<double>(count), ""});
}

/// Largest stable stiffness of the chain on a coarse ladder.
double stable_stiffness(const spidar::Geometry& geometry, const testing::SpidarChain::Options& options,
                        testing::Press press, double damping, double rung) {
  constexpr double kLeast = 500.0;
  constexpr double kMost = 40'000.0;
  double reached = 0.0;
  for (double stiffness = kLeast; stiffness <= kMost; stiffness *= rung) {
    if (!chain_wall_holds(geometry, options, press, stiffness, damping)) break;
    reached = stiffness;
  }
  return reached;
}

}  // namespace

void tell_device(const HapticsEffort& effort, std::vector<Figure>& figures) {
  const spidar::Geometry geometry = device();
  tell_pose(geometry, effort.ticks, figures);
  tell_times(geometry, static_cast<int>(effort.ticks), figures);
  tell_wrenches(geometry, effort.wrenches, figures);
}

std::vector<WallPoint> tell_walls(const HapticsEffort& effort, std::vector<Figure>& figures) {
  struct Reference {
    double rate_hz;
    double stiffness;  ///< of the ideal wall with steps of 16.7 um [N/m]
  };
  constexpr Reference kReferences[] = {{1000.0, 2700.0}, {4000.0, 5900.0}, {10'000.0, 9400.0}};
  const spidar::Geometry geometry = device();
  std::vector<WallPoint> points;
  for (const auto& [rate, reference] : kReferences) {
    const std::string name = "wall, " + std::to_string(static_cast<int>(rate / 1000.0)) + " kHz: ";
    const double ideal = testing::largest_stiffness(
        [rate = rate, &geometry](double k) { return testing::ideal_wall_holds(k, rate, geometry.metres_per_count); });
    figures.push_back({name + "stable stiffness of the ideal one", ideal, "N/m"});
    for (const bool hand : {true, false}) {
      double most = 0.0;
      for (const double damping : effort.dampings) {
        const double found = stable_stiffness(
            geometry, {.rate_hz = rate}, hand ? testing::Press::kHand : testing::Press::kBand, damping, effort.rung);
        points.push_back({.rate_hz = rate, .hand = hand, .damping = damping, .stiffness = found});
        most = std::max(most, found);
      }
      const std::string who = hand ? "with a hand" : "without a hand";
      figures.push_back({name + "stable stiffness of the chain, " + who, most, "N/m"});
      if (hand) figures.push_back({name + "ideal / chain, " + who, reference / most, "", kIdealOverChain});
    }
    testing::SpidarChain::Options smooth{.rate_hz = rate};
    smooth.parts.friction = 0.0;
    double most = 0.0;
    for (const double damping : effort.dampings) {
      most = std::max(most, stable_stiffness(geometry, smooth, testing::Press::kHand, damping, effort.rung));
    }
    figures.push_back({name + "stable stiffness of the chain, pulleys without friction", most, "N/m"});
  }
  return points;
}

}  // namespace layfigure::bench
