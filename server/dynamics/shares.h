#pragma once

#include <array>
#include <span>

#include "layfigure/dynamics/step.h"

namespace layfigure::dynamics {

/// How the runs of an order are shared between threads. The first share, the caller's, is of the coarsest runs.
struct Shares {
  int count{1};
  std::array<int, kMaxOrder + 1> ends{};  ///< share k is runs ends[k] .. ends[k + 1] - 1
};

/// The shares that are all made soonest, by at most so many threads. costs[k]: of a sub-step of k + 1 runs side by
/// side, in slots of packs; one for each run. Runs that come from another thread's cache cost as well.
[[nodiscard]] Shares share_runs(std::span<const double> costs, int bodies, int threads);

}  // namespace layfigure::dynamics
