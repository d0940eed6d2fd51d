#pragma once

#include <string>
#include <vector>

#include "stress_scene.h"

/// What must hold after every step of a scene.
namespace layfigure::testing {

/// Quaternions that are not unit, bones that are not as long as the model has them; empty if all are.
[[nodiscard]] std::string broken_geometry(const dynamics::Model& model, const dynamics::State& state);

/// Forces of contacts, ties and drives in the last step that are not finite or that their laws do not allow.
[[nodiscard]] std::string broken_answer(const scene::Scene& stepper, const StressScene& scene);

/// How deep shapes may be in each other.
class OverlapBound {
 public:
  explicit OverlapBound(const scene::SceneDefinition& definition);

  /// Looks at the contacts with which a step began; then allows for what the step may have added. Rows that are
  /// contradictory, or shapes so deep in each other that their normal need not be the best (collision/world.h), end the
  /// watch.
  [[nodiscard]] std::string grown(const scene::Scene& stepper, const dynamics::State& before,
                                  const dynamics::State& after, double h, bool infeasible);

 private:
  std::vector<double> radii_;  ///< of each body's shapes about its com [m], 0: none
  double smallest_;            ///< radius among the shapes [m]
  double allowed_;             ///< [m]
  bool watching_;
};

}  // namespace layfigure::testing
