// The cost of one step under google-benchmark, for profilers and comparisons between commits: step/order/threads.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <string>
#include <variant>

#include "layfigure/scene/scene.h"
#include "scene.h"
#include "touching_scenes.h"

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

/// Of 32 vertices, spread evenly.
collision::ConvexHull hull_in(const collision::Capsule& capsule) {
  constexpr int kVertices = 32;
  collision::ConvexHull hull;
  for (int k = 0; k < kVertices; ++k) {
    const double z = (2.0 * k + 1.0) / kVertices - 1.0;
    const double angle = k * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double across = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(across * std::cos(angle), across * std::sin(angle), z);
    hull.vertices.push_back(capsule.radius * direction +
                            std::copysign(capsule.half_length, z) * Eigen::Vector3d::UnitZ());
  }
  return hull;
}

/// A doll of hulls that falls on the floor and comes to lie there in a heap.
void falling_doll_of_hulls(benchmark::State& state) {
  constexpr double kDuration = 2.0;
  scene::SceneDefinition definition = testing::capsule_doll(0.9, 2.0);
  for (collision::ShapeDefinition& shape : definition.shapes) {
    if (const auto* capsule = std::get_if<collision::Capsule>(&shape.shape)) shape.shape = hull_in(*capsule);
  }
  scene::Scene scene(definition);
  const dynamics::State start = dynamics::initial_state(scene.model());
  dynamics::State doll = start;
  for (auto _ : state) {
    if (doll.time > kDuration) {
      doll = start;
      scene.forget();
    }
    benchmark::DoNotOptimize(scene.step(doll, {}, {.step = 1.0 / 240.0}));
  }
}

void each_order(benchmark::internal::Benchmark* benchmark) {
  benchmark->UseRealTime()->ArgNames({"", "threads"});
  for (int order = 1; order <= dynamics::kMaxOrder; ++order) {
    for (int threads = 1; threads <= 2; ++threads) benchmark->Args({order, threads});
  }
}
BENCHMARK(doll_52)->Apply(each_order);
BENCHMARK(pulled_doll_52)->Apply(each_order);
BENCHMARK(chain_60)->Apply(each_order);
BENCHMARK(falling_doll_of_hulls);

}  // namespace
