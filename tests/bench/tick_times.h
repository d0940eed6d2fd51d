#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace layfigure::bench {

/// Of single calls, by the wall clock, which is what a haptic loop goes by [us].
struct CallTimes {
  double median;
  double p99_9;
};

/// `call` is called so often, each time with its number.
template <class Call>
CallTimes time_calls(long count, Call call) {
  using Clock = std::chrono::steady_clock;
  constexpr double kTail = 0.999;
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(count));
  for (long k = 0; k < count; ++k) {
    const auto start = Clock::now();
    call(k);
    times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  std::sort(times.begin(), times.end());
  const auto at = [&](double part) { return times[static_cast<std::size_t>(part * static_cast<double>(count - 1))]; };
  return {.median = at(0.5), .p99_9 = at(kTail)};
}

}  // namespace layfigure::bench
