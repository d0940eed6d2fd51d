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
  const testing::Pulls pulls(scene.pulls);
  const dynamics::Inputs inputs{.loads = pulls.empty() ? nullptr : &pulls};
  for (auto _ : state) {
    if (doll.time > scene.duration) doll = start;
    benchmark::DoNotOptimize(dynamics::step(model, doll, workspace, inputs, options));
  }
}

void doll_52(benchmark::State& state) {
  step_scene(state, testing::load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json"));
}
/// Its joints flow all the time.
void pulled_doll_52(benchmark::State& state) {
  testing::Scene scene = testing::load_scene(LAYFIGURE_TEST_DATA "/scenes/doll-52.json");
  for (dynamics::BodyDefinition& body : scene.definition.bodies) body.joint.yield_torque = 0.5;
  scene.pulls = {{.body = 9, .force = {0.0, 20.0, 10.0}, .start = 0.0, .end = 0.2},
                 {.body = 20, .force = {10.0, 0.0, 10.0}, .start = 0.0, .end = 0.2}};
  scene.duration = 0.2;
  step_scene(state, scene);
}
void chain_60(benchmark::State& state) { step_scene(state, testing::chain({.links = 60, .bend = 0.3})); }

void each_order(benchmark::internal::Benchmark* benchmark) {
  benchmark->UseRealTime()->ArgNames({"", "threads"});
  for (int order = 1; order <= dynamics::kMaxOrder; ++order) {
    for (int threads = 1; threads <= 2; ++threads) benchmark->Args({order, threads});
  }
}
BENCHMARK(doll_52)->Apply(each_order);
BENCHMARK(pulled_doll_52)->Apply(each_order);
BENCHMARK(chain_60)->Apply(each_order);

}  // namespace
