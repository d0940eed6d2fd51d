// The cost of one step under google-benchmark, for profilers and comparisons between commits: step/order/threads.
#include <benchmark/benchmark.h>

#include <string>

#include "scene.h"

namespace {

using namespace layfigure;

void step_scene(benchmark::State& state, const testing::Scene& scene) {
  const dynamics::Model model(scene.definition);
  dynamics::State doll = dynamics::initial_state(model);
  const dynamics::State start = doll;
  dynamics::Workspace workspace(model, static_cast<int>(state.range(1)));
  const dynamics::StepOptions options{.step = 1e-3, .order = static_cast<int>(state.range(0))};
  for (auto _ : state) {
    if (doll.time > scene.duration) doll = start;
    benchmark::DoNotOptimize(dynamics::step(model, doll, workspace, {}, options));
  }
}

void doll_52(benchmark::State& state) {
  step_scene(state, testing::load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json"));
}
void chain_60(benchmark::State& state) { step_scene(state, testing::chain({.links = 60, .bend = 0.3})); }

void each_order(benchmark::internal::Benchmark* benchmark) {
  benchmark->UseRealTime()->ArgNames({"", "threads"});
  for (int order = 1; order <= dynamics::kMaxOrder; ++order) {
    for (int threads = 1; threads <= 2; ++threads) benchmark->Args({order, threads});
  }
}
BENCHMARK(doll_52)->Apply(each_order);
BENCHMARK(chain_60)->Apply(each_order);

}  // namespace
