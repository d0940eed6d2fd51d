#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <vector>

#include "figures.h"
#include "scene.h"
#include "subjects.h"

namespace layfigure::bench {
namespace {

constexpr int kRuns = 15;
constexpr int kSteps = 1000;
// What the base step of the 52-joint doll is held to.
constexpr double kTargetMicroseconds = 0.1;

void measure(const testing::Scene& scene, const dynamics::Model& model, int order, std::vector<Figure>& figures) {
  std::vector<double> per_solve, per_step;
  for (int k = 0; k < kRuns; ++k) {
    const auto run = testing::run_scene(scene, model, kSteps, order);
    // The runs of an extrapolation are solved side by side: order p makes p (p + 1) / 2 solves in p packs.
    const double solves = static_cast<double>(run.solves) * (order + 1) / 2.0;
    per_solve.push_back(run.cpu_seconds / solves / model.size() * 1e6);
    per_step.push_back(run.cpu_seconds / kSteps * 1e6);
  }
  std::sort(per_solve.begin(), per_solve.end());
  std::sort(per_step.begin(), per_step.end());
  const std::string name = scene.name + " order " + std::to_string(order);
  figures.push_back({name + " step", per_step[kRuns / 2], "us"});
  figures.push_back({name + " step, least of the runs", per_step.front(), "us"});
  figures.push_back({name + " step, most of the runs", per_step.back(), "us"});
  figures.push_back({name + " per joint and solve", per_solve[kRuns / 2], "us", kTargetMicroseconds});
}

/// Wall time of a step [us].
double wall_time(const dynamics::Model& model, dynamics::Workspace& workspace, int order) {
  dynamics::State state = initial_state(model);
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < kSteps; ++k) {
    const auto report = step(model, state, workspace, {}, {.step = 1e-3, .order = order});
    if (report.status != dynamics::StepStatus::kOk) throw std::runtime_error("cost: a step failed");
  }
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count() / kSteps;
}

/// What a second thread saves: the least of runs that take turns.
void measure_threads(const testing::Scene& scene, const dynamics::Model& model, std::vector<Figure>& figures) {
  dynamics::Workspace alone(model);
  dynamics::Workspace shared(model, 2);
  std::vector<double> base;
  for (int k = 0; k < kRuns; ++k) base.push_back(wall_time(model, alone, 1));
  const double base_step = *std::min_element(base.begin(), base.end());
  for (int order = 2; order <= dynamics::kMaxOrder; ++order) {
    std::vector<double> one, two;
    for (int k = 0; k < kRuns; ++k) {
      one.push_back(wall_time(model, alone, order));
      two.push_back(wall_time(model, shared, order));
    }
    const double least = *std::min_element(two.begin(), two.end());
    const std::string name = scene.name + " order " + std::to_string(order);
    figures.push_back({name + ", wall time: two threads / one", least / *std::min_element(one.begin(), one.end()), ""});
    figures.push_back({name + ", wall time: two threads / base step", least / base_step, ""});
  }
}

}  // namespace

void cost(const CostOptions& options) {
  const testing::Scene scene = testing::load_scene(options.scene);
  const dynamics::Model model(scene.definition);
  std::vector<Figure> figures;
  for (int order = 1; order <= dynamics::kMaxOrder; ++order) measure(scene, model, order, figures);
  measure_threads(scene, model, figures);
  print(figures, options.json);
}

}  // namespace layfigure::bench
