#pragma once

#include <algorithm>
#include <vector>

#include "cpu_clock.h"
#include "scene.h"

/// Scenes whose limbs meet a floor, and what is measured of them in any engine.
namespace layfigure::testing {

/// How an engine keeps limbs on the floor.
struct Touch {
  double penetration{0.0};  ///< largest depth below the floor among the poses that were looked at [m]
  double kinetic{0.0};      ///< energy at the end: what is left of the motion [J]
  double support{0.0};      ///< vertical sum of the contact forces of the last step, as the engine tells them [N]
};

/// Turns z into the limb's axis; a ball is not turned.
[[nodiscard]] Eigen::Quaterniond limb_rotation(const Limb& limb);

/// How deep the deepest limb is in the floor [m], 0 if none is.
[[nodiscard]] double penetration(const Scene& scene, const std::vector<dynamics::BodyPose>& poses);

/// How often a run looks at the poses.
constexpr int kLooks = 64;

/// Makes `steps` steps and looks at the poses on the way, which is not timed.
struct WatchedSteps {
  double cpu_seconds{0.0};
  double penetration{0.0};
};
template <class Step, class Poses>
WatchedSteps watch_steps(const Scene& scene, int steps, Step step, Poses poses) {
  WatchedSteps watched;
  const int chunk = std::max(1, steps / kLooks);
  for (int done = 0; done < steps; done += chunk) {
    const double start = thread_cpu_seconds();
    for (int k = done; k < std::min(done + chunk, steps); ++k) step(k);
    watched.cpu_seconds += thread_cpu_seconds() - start;
    watched.penetration = std::max(watched.penetration, penetration(scene, poses()));
  }
  return watched;
}

/// Steps a scene that has a floor to its end by scene::Scene, with `steps` equal steps.
struct FloorRun {
  RunResult result;
  Touch touch;
};
[[nodiscard]] FloorRun run_on_floor(const Scene& scene, int steps, int order);

}  // namespace layfigure::testing
