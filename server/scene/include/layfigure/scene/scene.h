#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "layfigure/collision/shapes.h"
#include "layfigure/collision/world.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"

namespace layfigure::scene {

/// Jointed bodies and what they can touch.
struct SceneDefinition {
  dynamics::ModelDefinition model;
  std::vector<collision::ShapeDefinition> shapes;  ///< on the model's bodies, or on what does not move
  /// Bodies that never meet, beside those that share a joint: neighbours' shapes overlap.
  std::vector<std::pair<int, int>> excluded;
};

struct SceneReport {
  dynamics::StepReport step;
  collision::UpdateReport collision;
};

/// Steps a model with the contacts that its shapes make. Where no two shapes may meet nothing is looked for.
///
/// Contacts are found at the beginning of a step, within as far as each body may get in it, so that nothing is passed
/// through at any step length; a contact's points then move with their bodies while its plane stays. What that leaves
/// is an overlap of about (w h)^2 R / 2 per step, for a surface of radius R (a hull: its distance from the com) turning
/// at w, undone over kRecoveryTime.
///
/// One per thread. Copy a State to save it; after restoring one call forget().
class Scene {
 public:
  /// Throws std::invalid_argument that names the body or shape, the value and the allowed range.
  explicit Scene(SceneDefinition definition);
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  [[nodiscard]] const dynamics::Model& model() const;

  /// dynamics::step() with the contacts; inputs.contacts must be empty. O(n) beside it; allocates only where there are
  /// more contacts than ever before.
  [[nodiscard]] SceneReport step(dynamics::State& state, const dynamics::Inputs& inputs,
                                 const dynamics::StepOptions& options);

  /// Those of the last step, as they were at its beginning: touching, or near enough to touch within it.
  [[nodiscard]] std::span<const collision::ContactPoint> contacts() const;
  /// What contact `index` exerted on its body a, world [N]; zero if it was left out.
  [[nodiscard]] const Eigen::Vector3d& contact_force(int index) const;
  [[nodiscard]] const dynamics::BodyForce& coupling_force(int index) const;
  [[nodiscard]] const dynamics::BodyForce& tie_force(int index) const;
  [[nodiscard]] const Eigen::Vector3d& drive_torque(int index) const;

  /// Contacts of these bodies are found and told, but exert nothing: whoever moves the bodies solves them.
  void leave_contacts_out(std::vector<int> bodies);
  /// Those that the last step left out, as it would have taken them.
  [[nodiscard]] std::span<const dynamics::Contact> left_out() const;

  /// What steps are made in: for dynamics/ports.h.
  [[nodiscard]] dynamics::Workspace& workspace();

  /// Drops what contacts remember from step to step: what follows depends on the state alone, bit for bit.
  void forget();

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace layfigure::scene
