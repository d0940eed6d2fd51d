#include <algorithm>
#include <cstdio>
#include <iostream>

#include "precision_run.h"
#include "scene.h"
#include "subjects.h"

namespace layfigure::bench {
namespace {

using testing::Scene;

// The error shown in the table is that against the highest order with steps this much shorter than the shortest asked
// for.
constexpr int kReferenceFactor = 8;

/// A row and where the joints' flow left their rest rotations.
struct OwnRow {
  Row row;
  std::vector<Eigen::Quaterniond> rests;
};

testing::FloorRun run_own(const Scene& scene, const dynamics::Model& model, int steps, int order) {
  if (scene.floor) return testing::run_on_floor(scene, steps, order);
  return {.result = testing::run_scene(scene, model, steps, order), .touch = {}};
}

OwnRow measure_own(const Scene& scene, const dynamics::Model& model, double h, int order) {
  OwnRow own;
  own.row = measure(scene, h, [&](int steps) {
    const auto [run, touch] = run_own(scene, model, steps, order);
    own.rests.clear();
    for (const auto& body : run.state.bodies) own.rests.push_back(body.rest_rotation);
    return Outcome{.coms = run.coms,
                   .energy = dynamics::energy(model, run.state).total(),
                   .finite = run.finite,
                   .cpu_seconds = run.cpu_seconds,
                   .touch = touch};
  });
  return own;
}

nlohmann::ordered_json json_of(const Scene& scene, int order, const OwnRow& own) {
  nlohmann::ordered_json json{{"scene", scene.name}, {"order", order}};
  json.update(bench::json_of(scene, own.row));
  auto rests = nlohmann::ordered_json::array();
  for (const auto& q : own.rests) rests.push_back({q.w(), q.x(), q.y(), q.z()});
  json["rest"] = rests;
  return json;
}

void print_table(const Scene& scene, const dynamics::Model& model, int order, const std::vector<OwnRow>& rows) {
  double shortest = rows.front().row.h;
  for (const OwnRow& own : rows) shortest = std::min(shortest, own.row.h);
  const auto reference =
      run_own(scene, model, kReferenceFactor * steps_of(scene, shortest), dynamics::kMaxOrder).result;
  std::printf("%s, %d bodies, %g s, order %d\n", scene.name.c_str(), model.size(), scene.duration, order);
  std::printf("%12s %8s %12s %12s %12s %7s\n", "h [s]", "steps", "CPU [ms]", "us/step", "error [m]", "finite");
  for (const auto& [row, rests] : rows) {
    std::printf("%12.6g %8d %12.3f %12.3f %12.3e %7s\n", row.h, row.steps, row.cpu_seconds * 1e3,
                row.cpu_seconds / row.steps * 1e6, testing::rms_distance(row.outcome.coms, reference.coms),
                row.outcome.finite ? "yes" : "no");
  }
}

}  // namespace

void work_precision(const WorkPrecisionOptions& options) {
  const Scene scene = testing::load_scene(options.scene);
  const dynamics::Model model(scene.definition);
  std::vector<OwnRow> rows;
  for (const double h : options.h) rows.push_back(measure_own(scene, model, h, options.order));
  if (!options.json) {
    print_table(scene, model, options.order, rows);
    return;
  }
  auto list = nlohmann::ordered_json::array();
  for (const OwnRow& own : rows) list.push_back(json_of(scene, options.order, own));
  std::cout << list.dump(1) << "\n";
}

}  // namespace layfigure::bench
