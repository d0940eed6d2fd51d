#include "shares.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace layfigure::dynamics {
namespace {

// Measured on a doll and on chains, in slots: to hand a share to another thread and wait for it, and to read one body
// of a run that another thread has made.
constexpr double kHandOver = 3.0;
constexpr double kForeignBody = 0.4;

/// Of all sub-steps of runs first .. end - 1: run k has k + 1.
double cost_of(std::span<const double> costs, int first, int end) {
  double sum = 0.0;
  for (int sub = 0; sub < end; ++sub) sum += costs[end - std::max(first, sub) - 1];
  return sum;
}

/// The shares that end before run k + 1 where bit k of `cuts` is set.
Shares shares_of(unsigned cuts, int order) {
  Shares shares{.count = 0};
  for (int end = 1; end <= order; ++end) {
    if (end == order || (cuts >> (end - 1) & 1U) != 0) shares.ends[++shares.count] = end;
  }
  return shares;
}

double time_of(const Shares& shares, std::span<const double> costs, int bodies) {
  double longest = 0.0;
  for (int k = 0; k < shares.count; ++k) {
    longest = std::max(longest, cost_of(costs, shares.ends[k], shares.ends[k + 1]));
  }
  const int foreign = shares.ends[shares.count] - shares.ends[1];
  return longest + kHandOver * (shares.count - 1) + kForeignBody * bodies * foreign;
}

}  // namespace

Shares share_runs(std::span<const double> costs, int bodies, int threads) {
  const int order = static_cast<int>(costs.size());
  Shares best;
  double least = std::numeric_limits<double>::infinity();
  for (unsigned cuts = 0; cuts < 1U << (order - 1); ++cuts) {
    if (std::popcount(cuts) >= threads) continue;
    const Shares shares = shares_of(cuts, order);
    const double time = time_of(shares, costs, bodies);
    if (time >= least) continue;
    least = time;
    best = shares;
  }
  return best;
}

}  // namespace layfigure::dynamics
