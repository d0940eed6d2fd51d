#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "layfigure/dynamics/step.h"

/// Random scenes that no artist would make: everything that the solver must survive.
namespace layfigure::testing {

struct StressScene {
  std::uint64_t seed{0};
  dynamics::ModelDefinition definition;
  std::vector<Eigen::Vector3d> spins;                 ///< angular velocity of each body at the start [rad/s]
  std::vector<dynamics::BodyForce> forces;            ///< constant, one per body
  std::vector<dynamics::Coupling> couplings;          ///< their targets jump by `teleport` half way
  Eigen::Vector3d teleport{Eigen::Vector3d::Zero()};  ///< [m]
  double h{1e-3};                                     ///< [s]
  int steps{20};
  int order{1};
};

/// The scene of a seed, always the same: 1 to 24 bodies, mass ratios up to 1e6, K_f from 0 to 1e9, h from 1e-5 to 0.1
/// s, forces up to 1e6 N, spins up to 1e3 rad/s, degenerate inertias, bones without length.
[[nodiscard]] StressScene random_scene(std::uint64_t seed);

/// What is wrong with the scene's run; empty if nothing is.
[[nodiscard]] std::string failure_of(const StressScene& scene);

/// The smallest scene found that still fails, by leaving out bodies, loads, couplings and steps.
[[nodiscard]] StressScene shrink(StressScene scene);

/// Writes the scene as text that a person can read, with its seed and what fails.
void write_report(const StressScene& scene, const std::string& path);

}  // namespace layfigure::testing
