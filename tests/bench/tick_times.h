#pragma once

#include <algorithm>
#include <vector>

#include "cpu_clock.h"

namespace layfigure::bench {

/// Of single calls, by the thread's CPU clock, so that what else the machine does does not count; reading it costs some
/// 0.3 us, which does [us].
struct CallTimes {
  double median;
  double p99_9;
};

/// `call` is called so often, each time with its number.
template <class Call>
CallTimes time_calls(long count, Call call) {
  constexpr double kTail = 0.999;
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(count));
  for (long k = 0; k < count; ++k) {
    const double start = testing::thread_cpu_seconds();
    call(k);
    times.push_back((testing::thread_cpu_seconds() - start) * 1e6);
  }
  std::sort(times.begin(), times.end());
  const auto at = [&](double part) { return times[static_cast<std::size_t>(part * static_cast<double>(count - 1))]; };
  return {.median = at(0.5), .p99_9 = at(kTail)};
}

}  // namespace layfigure::bench
