// The cost of a haptic tick's part for the SPIDAR under google-benchmark: pose and tensions, by the force asked for. At
// 5 N a G6X3 can do all, at 60 N hardly any. The counters tell single ticks: median, 99.9th percentile, most.
#include <benchmark/benchmark.h>

#include "layfigure/spidar/geometry.h"
#include "spidar_ticks.h"

namespace {

using namespace layfigure;

constexpr int kTicks = 200'000;

void spidar_tick(benchmark::State& state, int passes) {
  const spidar::Geometry geometry = spidar::load_geometry(LAYFIGURE_SPIDAR_FILES "/g6x3.toml");
  bench::SpidarTicks ticks{};
  for (auto _ : state)
    ticks = bench::measure_spidar_ticks(geometry, kTicks, passes, static_cast<double>(state.range(0)));
  state.counters["p50_us"] = ticks.median_us;
  state.counters["p99.9_us"] = ticks.p99_9_us;
  state.counters["most_us"] = ticks.most_us;
  state.counters["beyond"] = ticks.beyond_share;
  state.counters["error_N"] = ticks.exact_error;
  state.counters["pivots"] = ticks.most_pivots;
}

void raw(benchmark::State& state) { spidar_tick(state, 1); }
void least_of_5(benchmark::State& state) { spidar_tick(state, 5); }

BENCHMARK(raw)->Arg(5)->Arg(20)->Arg(60)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(least_of_5)->Arg(5)->Arg(20)->Arg(60)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
