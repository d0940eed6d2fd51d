// The cost of one step under google-benchmark, for profilers and comparisons between commits.
#include <benchmark/benchmark.h>

#include <string>

#include "scene.h"

namespace {

using namespace layfigure;

void step_scene(benchmark::State& state, const testing::Scene& scene) {
  const dynamics::Model model(scene.definition);
  dynamics::State doll = dynamics::initial_state(model);
  const dynamics::State start = doll;
  dynamics::Workspace workspace(model);
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

BENCHMARK(doll_52)->DenseRange(1, dynamics::kMaxOrder);
BENCHMARK(chain_60)->DenseRange(1, dynamics::kMaxOrder);

}  // namespace
