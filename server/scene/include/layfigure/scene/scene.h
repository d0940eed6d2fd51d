#pragma once

#include <Eigen/Core>
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

/// Points that a soft body's contact is spread over: the fewest that resist tilting the same way about all axes.
inline constexpr int kPadPoints = 3;

/// A body that touches like a soft fingertip: not at a point but with a pad, which resists spin about the normal too.
///
/// Each of its contact points p becomes kPadPoints of them, evenly on the circle of radius r about p + d m in the plane
/// across the normal, d the pad's depth and m the normal into its body; all with p's gap, normal n and coefficient mu:
/// the pad lies against whatever curvature it meets. They share p's normal force N. The friction that they can exert,
/// force f in the plane and torque t about n, is bounded by the limit surface of most dissipation: with v the pad's
/// slip and w its spin, t_i the tangents of the circle,
///     f . v + t w  <=  mu sum N_i |v + w r t_i|
/// Slip without spin begins at |f| = mu N, however N is shared out; spin without slip at |t| = mu N r. Between these,
/// by Jensen's inequality, the surface lies within the ellipsoid |f|^2 + (t / r)^2 = (mu N)^2 (Howe & Cutkosky 1996,
/// "Practical force-motion models for sliding manipulation", IJRR 15(6)), which is the usual model of a soft finger, by
/// at most 18 % where N is shared evenly.
///
/// A tilt about an axis in the plane is resisted with up to N r / 2 before a point lifts: the pad turns over after
/// that. How it does so is the depth's: what holds together there, at p + d m, is what it turns about. With d = 0 that
/// is the surface, and a ball of radius R that is tilted by w rolls, its centre going by R m x w. Rolled about in
/// circles it does not come back to where it was, and turns what it lies on (Montana 1988, "The kinematics of contact
/// and grasp", IJRR 7(3): rolling is not holonomic). With d = R the pad turns over about the ball's centre, which
/// stays: as flesh does, that is held and not let go. Both bodies' forces act at the one point p + d m, so they are
/// each other's opposite in force and moment at any depth, and friction takes energy as ever.
struct Pad {
  int body{0};
  double radius{0.0};  ///< r [m], >= 0; of a disc of even pressure: 2/3 of the disc's
  double depth{0.0};   ///< d [m], >= 0
};

/// Jointed bodies and what they can touch.
struct SceneDefinition {
  dynamics::ModelDefinition model;
  std::vector<collision::ShapeDefinition> shapes;  ///< on the model's bodies, or on what does not move
  /// Bodies that never meet, beside those that share a joint: neighbours' shapes overlap.
  std::vector<std::pair<int, int>> excluded;
  std::vector<Pad> pads{};  ///< where two meet the larger radius holds
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
  /// `threads` as Workspace's. Throws std::invalid_argument that names the body, shape or pad, the value and the
  /// allowed range.
  explicit Scene(SceneDefinition definition, int threads = 1);
  /// The same scene, made sooner, on one thread: hulls that `like` has too, under the same index, are taken over.
  Scene(SceneDefinition definition, const Scene& like);
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
  /// What contact `index` exerted on its body a, world [N]; a pad's whole force; zero if it was left out.
  [[nodiscard]] Eigen::Vector3d contact_force(int index) const;
  [[nodiscard]] const dynamics::BodyForce& coupling_force(int index) const;
  [[nodiscard]] const dynamics::BodyForce& tie_force(int index) const;
  [[nodiscard]] const Eigen::Vector3d& drive_torque(int index) const;

  /// These pairs of bodies go through each other from now on, all others touch: for what a tie holds together already.
  /// Allocates.
  void let_through(std::span<const std::pair<int, int>> pairs);

  /// How deep the body lies in others in this state [m]; 0: not at all. As forget() beside it; O(n).
  [[nodiscard]] double depth_of(const dynamics::State& state, int body);

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
