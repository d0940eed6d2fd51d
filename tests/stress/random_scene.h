#pragma once

#include <cstdint>

#include "stress_scene.h"

/// Random scenes that no artist would make: everything that the solver must survive.
namespace layfigure::testing {

/// The scene of a seed, always the same: 1 to 24 bodies, mass ratios up to 1e6, K_f from 0 to 1e9, h from 1e-5 to 0.1
/// s, forces up to 1e6 N, spins up to 1e3 rad/s, degenerate inertias, bones without length, hands that jump by metres;
/// in some of them spheres, capsules and hulls over a floor or in it, ties that close loops or contradict each other,
/// asymmetric limits that the start may be beyond, drives, a softness that changes on the way, and sleep.
[[nodiscard]] StressScene random_scene(std::uint64_t seed);

}  // namespace layfigure::testing
