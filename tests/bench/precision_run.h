#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "floor_scene.h"
#include "scene.h"

/// What the engines of the work-precision benchmark share: how a run is timed and told.
namespace layfigure::bench {

/// Where one run of a scene ended.
struct Outcome {
  std::vector<Eigen::Vector3d> coms;  ///< world [m]
  double energy{0.0};                 ///< [J]
  bool finite{true};
  double cpu_seconds{0.0};  ///< of the stepping alone
  testing::Touch touch{};   ///< of scenes with a floor
};

struct Row {
  double h;  ///< [s], such that the steps end at the scene's end
  int steps;
  double cpu_seconds;  ///< median of the runs
  Outcome outcome;
};

/// As many equal steps as come nearest to h, at least one.
[[nodiscard]] int steps_of(const testing::Scene& scene, double h);

/// Runs a scene with steps of about h, short ones several times.
[[nodiscard]] Row measure(const testing::Scene& scene, double h, const std::function<Outcome(int steps)>& run);

/// The fields of a row that every engine's output has; of a scene with a floor "touch" too.
[[nodiscard]] nlohmann::ordered_json json_of(const testing::Scene& scene, const Row& row);

}  // namespace layfigure::bench
