// What it costs to skin and to touch a character: skin_benchmark [--benchmark_filter=..]
// The tube has as many vertices, bones and influences as a human character; a file that LAYFIGURE_CHARACTER names takes
// its place.

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <random>
#include <vector>

#include "layfigure/character/import.h"
#include "layfigure/skinning/posed_skin.h"
#include "random_vector.h"
#include "tube_rig.h"

namespace {

using namespace layfigure;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using skinning::Blend;
using skinning::PosedSkin;
using skinning::Skin;

constexpr testing::Tube kHumanSized{.bones = 52, .bone_length = 0.033, .rings_per_bone = 16, .sides = 16};
constexpr double kTurn = 0.2;  // [rad] of each joint
constexpr unsigned kSeed = 17;
constexpr int kQueries = 1024;

character::Rig subject(int refinement) {
  const char* file = std::getenv("LAYFIGURE_CHARACTER");
  if (file != nullptr) return character::import_rig(file);
  testing::Tube tube = kHumanSized;
  tube.rings_per_bone *= refinement;
  tube.sides *= refinement;
  return testing::tube_rig(tube);
}

std::vector<Isometry3d> bent(const Skin& skin) {
  std::mt19937 generator(kSeed);
  std::vector<Isometry3d> X_WB;
  for (const character::Bone& bone : skin.bones()) {
    const Isometry3d X_PB = bone.rest * Eigen::AngleAxisd(kTurn, testing::random_vector(generator, 1.0).normalized());
    X_WB.push_back(bone.parent < 0 ? X_PB : X_WB[bone.parent] * X_PB);
  }
  return X_WB;
}

void report(benchmark::State& state, const Skin& skin) {
  state.counters["vertices"] = skin.vertex_count();
  state.counters["triangles"] = static_cast<double>(skin.triangles().size());
  const auto per_vertex = static_cast<double>(skin.vertex_count());
  state.counters["per_vertex"] =
      benchmark::Counter(per_vertex, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void deform(benchmark::State& state, Blend blend, bool with_normals) {
  const Skin skin(subject(1));
  skinning::DeformWorkspace workspace(skin);
  const std::vector<Isometry3d> X_WB = bent(skin);
  std::vector<Vector3d> positions(skin.vertex_count());
  std::vector<Vector3d> normals(with_normals ? skin.vertex_count() : 0);
  for (auto _ : state) {
    skinning::deform(skin, X_WB, blend, workspace, positions, normals);
    benchmark::DoNotOptimize(positions.data());
    benchmark::ClobberMemory();
  }
  report(state, skin);
}
BENCHMARK_CAPTURE(deform, linear, Blend::kLinear, false);
BENCHMARK_CAPTURE(deform, linear_with_normals, Blend::kLinear, true);
BENCHMARK_CAPTURE(deform, dual_quaternion, Blend::kDualQuaternion, false);
BENCHMARK_CAPTURE(deform, dual_quaternion_with_normals, Blend::kDualQuaternion, true);

void pose(benchmark::State& state) {
  PosedSkin posed{Skin(subject(1))};
  const std::vector<Isometry3d> X_WB = bent(posed.skin());
  for (auto _ : state) posed.pose(X_WB);
  report(state, posed.skin());
}
BENCHMARK(pose);

void build(benchmark::State& state) {
  const character::Rig rig = subject(1);
  for (auto _ : state) benchmark::DoNotOptimize(PosedSkin{Skin(rig)});
}
BENCHMARK(build)->Unit(benchmark::kMillisecond);

/// Points as far from the skin as `distance_mm` on average.
void closest_point(benchmark::State& state) {
  PosedSkin posed{Skin(subject(static_cast<int>(state.range(0))))};
  posed.pose(bent(posed.skin()));
  std::mt19937 generator(kSeed);
  const double distance = 1e-3 * static_cast<double>(state.range(1));
  std::vector<Vector3d> points;
  for (int i = 0; i < kQueries; ++i) {
    const auto vertex = generator() % posed.positions().size();
    points.emplace_back(posed.positions()[vertex] + testing::random_vector(generator, distance));
  }
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(posed.closest_point(points[i++ % kQueries]));
  report(state, posed.skin());
}
BENCHMARK(closest_point)->ArgNames({"refined", "distance_mm"})->ArgsProduct({{1, 2, 4}, {1, 10, 100, 1000}});

void cast_ray(benchmark::State& state) {
  PosedSkin posed{Skin(subject(static_cast<int>(state.range(0))))};
  posed.pose(bent(posed.skin()));
  std::mt19937 generator(kSeed);
  std::vector<Vector3d> origins;
  std::vector<Vector3d> directions;
  for (int i = 0; i < kQueries; ++i) {
    const Vector3d target = posed.positions()[generator() % posed.positions().size()];
    origins.push_back(target + testing::random_vector(generator, 1.0));
    directions.emplace_back(target + testing::random_vector(generator, 0.02) - origins.back());
  }
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(posed.cast_ray(origins[i % kQueries], directions[i % kQueries]));
    ++i;
  }
  report(state, posed.skin());
}
BENCHMARK(cast_ray)->ArgName("refined")->Arg(1)->Arg(2)->Arg(4);

}  // namespace
