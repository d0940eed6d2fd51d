#include <utility>

#include "stress_run.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

/// Makes the change if the scene still fails with it.
template <class Change>
bool try_change(StressScene& scene, const Change& change) {
  StressScene smaller = scene;
  change(smaller);
  if (run(smaller).failure.empty()) return false;
  scene = std::move(smaller);
  return true;
}

void drop_last_body(StressScene& scene) {
  scene.definition.model.bodies.pop_back();
  scene.spins.pop_back();
  scene.forces.pop_back();
  const int left = static_cast<int>(scene.definition.model.bodies.size());
  const auto gone = [left](const auto& item) { return item.body >= left; };
  std::erase_if(scene.couplings, gone);
  std::erase_if(scene.drives, gone);
  std::erase_if(scene.definition.shapes, gone);
  std::erase_if(scene.ties, [left](const Tie& tie) { return tie.body_a >= left || tie.body_b >= left; });
}

/// Leaves out what is not needed of a list.
template <class List>
void thin(StressScene& scene, const List& list) {
  for (std::size_t k = list(scene).size(); k-- > 0;) {
    try_change(scene, [&](StressScene& s) { list(s).erase(list(s).begin() + static_cast<std::ptrdiff_t>(k)); });
  }
}

void simplify_body(StressScene& scene, std::size_t i) {
  const auto body = [i](StressScene& s) -> BodyDefinition& { return s.definition.model.bodies[i]; };
  try_change(scene, [&](StressScene& s) { s.forces[i] = {}; });
  try_change(scene, [&](StressScene& s) { s.spins[i].setZero(); });
  try_change(scene, [&](StressScene& s) { body(s).limits = {}; });
  try_change(scene, [&](StressScene& s) { body(s).joint.shape = {}; });
  try_change(scene, [&](StressScene& s) { body(s).joint.hardening = 0.0; });
}

}  // namespace

StressScene shrink(StressScene scene) {
  while (scene.steps > 1 && try_change(scene, [](StressScene& s) { --s.steps; })) {
  }
  while (scene.definition.model.bodies.size() > 1 && try_change(scene, drop_last_body)) {
  }
  thin(
      scene, [](StressScene & s) -> auto& { return s.couplings; });
  thin(
      scene, [](StressScene & s) -> auto& { return s.ties; });
  thin(
      scene, [](StressScene & s) -> auto& { return s.drives; });
  thin(
      scene, [](StressScene & s) -> auto& { return s.definition.shapes; });
  try_change(scene, [](StressScene& s) { s.order = 1; });
  try_change(scene, [](StressScene& s) { s.softness = 1.0; });
  try_change(scene, [](StressScene& s) { s.sleep_angle = 0.0; });
  try_change(scene, [](StressScene& s) { s.teleport.setZero(); });
  try_change(scene, [](StressScene& s) { s.definition.model.gravity.setZero(); });
  for (std::size_t i = 0; i < scene.forces.size(); ++i) simplify_body(scene, i);
  return scene;
}

}  // namespace layfigure::testing
