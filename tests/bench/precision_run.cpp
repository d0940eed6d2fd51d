#include "precision_run.h"

#include <algorithm>
#include <cmath>

namespace layfigure::bench {
namespace {

constexpr int kRepeats = 5;
constexpr double kEnoughSeconds = 0.5;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

int steps_of(const testing::Scene& scene, double h) {
  return std::max(1, static_cast<int>(std::lround(scene.duration / h)));
}

Row measure(const testing::Scene& scene, double h, const std::function<Outcome(int steps)>& run) {
  Row row{.h = h, .steps = steps_of(scene, h), .cpu_seconds = 0.0, .outcome = {}};
  if (std::abs(row.steps * h - scene.duration) > 1e-9 * scene.duration) row.h = scene.duration / row.steps;
  std::vector<double> times;
  double spent = 0.0;
  for (int k = 0; k < kRepeats && spent < kEnoughSeconds; ++k) {
    row.outcome = run(row.steps);
    times.push_back(row.outcome.cpu_seconds);
    spent += times.back();
  }
  row.cpu_seconds = median(times);
  return row;
}

nlohmann::ordered_json json_of(const testing::Scene& scene, const Row& row) {
  auto com = nlohmann::ordered_json::array();
  for (const Eigen::Vector3d& p : row.outcome.coms) com.push_back({p.x(), p.y(), p.z()});
  nlohmann::ordered_json json{{"h", row.h},
                              {"steps", row.steps},
                              {"cpu_s", row.cpu_seconds},
                              {"us_per_step", row.cpu_seconds / row.steps * 1e6},
                              {"com", com},
                              {"energy", row.outcome.energy},
                              {"finite", row.outcome.finite}};
  const testing::Touch& touch = row.outcome.touch;
  if (scene.floor) {
    json["touch"] = {{"penetration", touch.penetration}, {"kinetic", touch.kinetic}, {"support", touch.support}};
  }
  return json;
}

}  // namespace layfigure::bench
