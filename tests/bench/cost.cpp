#include <algorithm>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <vector>

#include "scene.h"
#include "subjects.h"

namespace layfigure::bench {
namespace {

constexpr int kRuns = 15;
constexpr int kSteps = 1000;
// What the base step of the 52-joint doll is held to.
constexpr double kTargetMicroseconds = 0.1;

struct Cost {
  int order;
  double us_per_step;   ///< median of the runs
  double us_per_solve;  ///< per joint and solve: min, median, max of the runs
  double least;
  double most;
};

Cost measure(const testing::Scene& scene, const dynamics::Model& model, int order) {
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
  return {order, per_step[kRuns / 2], per_solve[kRuns / 2], per_solve.front(), per_solve.back()};
}

}  // namespace

void cost(const CostOptions& options) {
  const testing::Scene scene = testing::load_scene(options.scene);
  const dynamics::Model model(scene.definition);
  auto list = nlohmann::ordered_json::array();
  if (!options.json) {
    std::printf("%s, %d bodies, %d runs of %d steps\n", scene.name.c_str(), model.size(), kRuns, kSteps);
    std::printf("%6s %12s %18s %10s %10s\n", "order", "us/step", "us/joint/solve", "min", "max");
  }
  for (int order = 1; order <= dynamics::kMaxOrder; ++order) {
    const Cost c = measure(scene, model, order);
    if (!options.json) {
      std::printf("%6d %12.3f %18.4f %10.4f %10.4f\n", c.order, c.us_per_step, c.us_per_solve, c.least, c.most);
    } else {
      list.push_back({{"name", scene.name + " order " + std::to_string(order) + " per joint and solve"},
                      {"value", c.us_per_solve},
                      {"unit", "us"},
                      {"target", kTargetMicroseconds},
                      {"holds", c.us_per_solve <= kTargetMicroseconds}});
    }
  }
  if (options.json) std::cout << list.dump(1) << "\n";
}

}  // namespace layfigure::bench
