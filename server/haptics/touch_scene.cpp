#include "layfigure/haptics/touch_scene.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace layfigure::haptics {
namespace {

// A fingertip that begins deeper in something than this would be thrown out of it [m].
constexpr double kMaxStartDepth = 1e-3;

double mass_of(const doll::Doll& doll) {
  double mass = 0.0;
  for (const dynamics::BodyDefinition& body : doll.definition.bodies) mass += body.mass;
  return mass;
}

scene::SceneDefinition scene_of(const doll::Doll& doll, std::span<const FingertipInScene> fingertips) {
  scene::SceneDefinition definition{.model = doll.definition, .shapes = doll.shapes, .excluded = doll.never_touch};
  const int first = static_cast<int>(doll.definition.bodies.size());
  const double mass = fingertip_mass(mass_of(doll));
  for (const FingertipInScene& fingertip : fingertips) {
    const int body = static_cast<int>(definition.model.bodies.size());
    definition.model.bodies.push_back(fingertip_body(fingertip.pointer, fingertip.definition, mass, fingertip.pose));
    definition.shapes.push_back(fingertip_shape(fingertip.pointer, fingertip.definition, body));
    const double radius = fingertip.definition.radius;
    definition.pads.push_back({.body = body, .radius = kPadShare * radius, .depth = radius});
    for (int other = first; other < body; ++other) definition.excluded.emplace_back(other, body);
  }
  return definition;
}

}  // namespace

void TouchScene::Weights::add(double, std::span<dynamics::BodyForce> forces) const {
  for (std::size_t i = first; i < forces.size(); ++i) forces[i].force += lift;
}

TouchScene::TouchScene(const doll::Doll& doll)
    : doll_bodies_(static_cast<int>(doll.definition.bodies.size())),
      scene_(scene_of(doll, {})),
      state_(dynamics::initial_state(scene_.model())) {
  weights_.first = doll_bodies_;
  weights_.lift = -fingertip_mass(mass_of(doll)) * doll.definition.gravity;
}

int TouchScene::body_of(int pointer) const {
  const auto found = std::ranges::find(fingertips_, pointer, &FingertipInScene::pointer);
  return found == fingertips_.end() ? -1 : doll_bodies_ + static_cast<int>(found - fingertips_.begin());
}

int TouchScene::pointer_of(int body) const {
  return body < doll_bodies_ ? -1 : fingertips_[body - doll_bodies_].pointer;
}

/// The state of the bodies that stay, and of those that come at their start.
dynamics::State TouchScene::carried_over(const dynamics::Model& model,
                                         std::span<const FingertipInScene> fingertips) const {
  dynamics::State state = dynamics::initial_state(model);
  state.time = state_.time;
  state.constraints = state_.constraints;
  std::copy_n(state_.bodies.begin(), doll_bodies_, state.bodies.begin());
  for (std::size_t i = 0; i < fingertips.size(); ++i) {
    const int before = body_of(fingertips[i].pointer);
    if (before >= 0) state.bodies[doll_bodies_ + i] = state_.bodies[before];
  }
  return state;
}

void TouchScene::set_fingertips(const doll::Doll& doll, std::span<const FingertipInScene> fingertips) {
  scene::Scene scene(scene_of(doll, fingertips), scene_);
  dynamics::State state = carried_over(scene.model(), fingertips);
  for (std::size_t i = 0; i < fingertips.size(); ++i) {
    const int pointer = fingertips[i].pointer;
    if (body_of(pointer) >= 0 || scene.depth_of(state, doll_bodies_ + static_cast<int>(i)) <= kMaxStartDepth) continue;
    throw std::invalid_argument("the fingertip of pointer " + std::to_string(pointer) +
                                " would begin inside something; move the pointer out of it first");
  }
  scene_ = std::move(scene);
  state_ = std::move(state);
  fingertips_.assign(fingertips.begin(), fingertips.end());
  weights_.lift = -fingertip_mass(mass_of(doll)) * doll.definition.gravity;
}

void TouchScene::joints_changed() {
  for (dynamics::BodyState& body : state_.bodies) body.limit_slack = 0.0;
  dynamics::wake(scene_.model(), state_);
}

void TouchScene::put_back(dynamics::State state) {
  state.time = state_.time;
  state_ = std::move(state);
  scene_.forget();
}

void TouchScene::reset() {
  const double time = state_.time;
  state_ = dynamics::initial_state(scene_.model());
  state_.time = time;
  scene_.forget();
}

}  // namespace layfigure::haptics
