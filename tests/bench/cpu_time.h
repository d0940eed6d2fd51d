#pragma once

#include <algorithm>
#include <vector>

#include "cpu_clock.h"

namespace layfigure::bench {

/// CPU time of one call [s]: the median of some batches of calls, each long enough for the clock. What takes long is
/// called once.
template <class Call>
double cpu_seconds_of(Call call) {
  constexpr int kBatches = 7;
  constexpr double kBatch = 1e-3;
  constexpr double kLong = 0.1;
  int calls = 1;
  const auto batch = [&] {
    const double start = testing::thread_cpu_seconds();
    for (int k = 0; k < calls; ++k) call();
    return testing::thread_cpu_seconds() - start;
  };
  double spent = batch();
  if (spent >= kLong) return spent;
  for (; spent < kBatch; spent = batch()) calls *= 2;
  std::vector<double> batches;
  for (int k = 0; k < kBatches; ++k) batches.push_back(batch());
  std::nth_element(batches.begin(), batches.begin() + kBatches / 2, batches.end());
  return batches[kBatches / 2] / calls;
}

}  // namespace layfigure::bench
