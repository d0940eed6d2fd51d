#include <algorithm>
#include <vector>

#include "figures.h"
#include "random_scene.h"
#include "stress_run.h"
#include "subjects.h"

namespace layfigure::bench {
namespace {

// In scenes whose energies lie far beyond what their steps resolve, rounding may keep Newton's method from its
// tolerance: the same share as in the stress test.
constexpr double kUnconvergedShare = 1e-3;

struct Sums {
  int failed{0};  ///< scenes in which something was wrong (stress_run.h)
  double steps{0.0};
  double retried{0.0};
  double taken_back{0.0};
  double unconverged{0.0};
  double bodies{0.0};  ///< stepped
  double seconds{0.0};
  double longest{0.0};  ///< of a scene, per step [s]
};

Sums run_scenes(int scenes) {
  Sums sums;
  for (int seed = 0; seed < scenes; ++seed) {
    const testing::StressScene scene = testing::random_scene(seed);
    const testing::StressOutcome run = testing::run(scene);
    if (!run.failure.empty()) ++sums.failed;
    sums.steps += run.steps;
    sums.retried += run.retried;
    sums.taken_back += run.taken_back;
    sums.unconverged += run.unconverged;
    sums.bodies += static_cast<double>(run.steps) * static_cast<double>(scene.definition.model.bodies.size());
    sums.seconds += run.cpu_seconds;
    sums.longest = std::max(sums.longest, run.cpu_seconds / run.steps);
  }
  return sums;
}

}  // namespace

void stress(const StressOptions& options) {
  const Sums sums = run_scenes(options.scenes);
  const std::vector<Figure> figures{
      {"random scenes", static_cast<double>(options.scenes), ""},
      {"scenes that failed", static_cast<double>(sums.failed), "", 0.0},
      {"CPU time of their steps", sums.seconds, "s"},
      {"CPU time of a step, mean", sums.seconds / sums.steps * 1e6, "us"},
      {"CPU time of a step, mean of the slowest scene", sums.longest * 1e6, "us"},
      {"CPU time of a step per body, mean", sums.seconds / sums.bodies * 1e6, "us"},
      {"share of steps made again in shorter parts", sums.retried / sums.steps, ""},
      {"share of steps that energy was taken back in", sums.taken_back / sums.steps, ""},
      {"share of steps that did not converge", sums.unconverged / sums.steps, "", kUnconvergedShare},
  };
  print(figures, options.json);
}

}  // namespace layfigure::bench
