#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "scene.h"
#include "subjects.h"

namespace layfigure::bench {
namespace {

using testing::Scene;

// Short runs are repeated, and the least disturbed one counts.
constexpr int kRepeats = 5;
constexpr double kEnoughSeconds = 0.5;
// The error shown in the table is that against order 4 with steps this much shorter than the shortest asked for.
constexpr int kReferenceFactor = 8;

struct Row {
  double h;
  int steps;
  double cpu_seconds;
  testing::RunResult run;
};

/// As many equal steps as come nearest to h.
int steps_of(const Scene& scene, double h) { return std::max(1, static_cast<int>(std::lround(scene.duration / h))); }

Row measure(const Scene& scene, const dynamics::Model& model, double h, int order) {
  Row row{.h = h, .steps = steps_of(scene, h), .cpu_seconds = INFINITY, .run = {}};
  if (std::abs(row.steps * h - scene.duration) > 1e-9 * scene.duration) row.h = scene.duration / row.steps;
  double spent = 0.0;
  for (int k = 0; k < kRepeats && spent < kEnoughSeconds; ++k) {
    row.run = testing::run_scene(scene, model, row.steps, order);
    row.cpu_seconds = std::min(row.cpu_seconds, row.run.cpu_seconds);
    spent += row.run.cpu_seconds;
  }
  return row;
}

nlohmann::ordered_json json_of(const Scene& scene, const dynamics::Model& model, int order, const Row& row) {
  nlohmann::ordered_json com = nlohmann::ordered_json::array();
  for (const Eigen::Vector3d& p : row.run.coms) com.push_back({p.x(), p.y(), p.z()});
  return {{"scene", scene.name},
          {"order", order},
          {"h", row.h},
          {"steps", row.steps},
          {"cpu_s", row.cpu_seconds},
          {"us_per_step", row.cpu_seconds / row.steps * 1e6},
          {"com", com},
          {"energy", dynamics::energy(model, row.run.state).total()},
          {"finite", row.run.finite}};
}

void print_table(const Scene& scene, const dynamics::Model& model, int order, const std::vector<Row>& rows) {
  double shortest = rows.front().h;
  for (const Row& row : rows) shortest = std::min(shortest, row.h);
  const auto reference = testing::run_scene(scene, model, kReferenceFactor * steps_of(scene, shortest), 4);
  std::printf("%s, %d bodies, %g s, order %d\n", scene.name.c_str(), model.size(), scene.duration, order);
  std::printf("%12s %8s %12s %12s %12s %7s\n", "h [s]", "steps", "CPU [ms]", "us/step", "error [m]", "finite");
  for (const Row& row : rows) {
    std::printf("%12.6g %8d %12.3f %12.3f %12.3e %7s\n", row.h, row.steps, row.cpu_seconds * 1e3,
                row.cpu_seconds / row.steps * 1e6, testing::rms_distance(row.run.coms, reference.coms),
                row.run.finite ? "yes" : "no");
  }
}

}  // namespace

void work_precision(const WorkPrecisionOptions& options) {
  const Scene scene = testing::load_scene(options.scene);
  const dynamics::Model model(scene.definition);
  std::vector<Row> rows;
  for (const double h : options.h) rows.push_back(measure(scene, model, h, options.order));
  if (!options.json) {
    print_table(scene, model, options.order, rows);
    return;
  }
  auto list = nlohmann::ordered_json::array();
  for (const Row& row : rows) list.push_back(json_of(scene, model, options.order, row));
  std::cout << list.dump(1) << "\n";
}

}  // namespace layfigure::bench
