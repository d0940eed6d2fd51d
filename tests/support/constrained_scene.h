#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "layfigure/dynamics/constraints.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"

/// Scenes with contacts, ties and limits whose geometry the tests know.
namespace layfigure::testing {

/// A free box about the origin of its frame, which is on the floor's level at the start.
[[nodiscard]] dynamics::ModelDefinition block(double mass, const Eigen::Vector3d& half_size,
                                              const Eigen::Vector3d& gravity);

/// Contacts of the lower corners of body 0, a block, with the plane that it starts on.
[[nodiscard]] std::vector<dynamics::Contact> corner_contacts(const Eigen::Vector3d& half_size, double friction);

/// A branching tree of nine bodies with bent, strained joints of all kinds, moving.
[[nodiscard]] dynamics::ModelDefinition bent_tree(dynamics::RootKind root, double yield_torque);

/// Contacts of its limbs with the world and with each other, all of gap zero and closing under gravity.
[[nodiscard]] std::vector<dynamics::Contact> tree_contacts(const dynamics::Model& model, const dynamics::State& state);

/// One limb's end tied to another's, and one to the world in position and rotation.
[[nodiscard]] std::vector<dynamics::Tie> tree_ties(const dynamics::Model& model, const dynamics::State& state);

/// What the constraints of a step exerted, as loads of their own.
class ReplayedForces : public dynamics::Loads {
 public:
  ReplayedForces(const dynamics::Model& model, const dynamics::State& before,
                 const std::vector<dynamics::Contact>& contacts, const std::vector<dynamics::Tie>& ties,
                 const dynamics::Workspace& workspace);
  void add(double time, std::span<dynamics::BodyForce> forces) const override;

 private:
  void add_force(int body, const Eigen::Vector3d& position, const Eigen::Vector3d& force);

  std::vector<dynamics::BodyPose> poses_;
  std::vector<dynamics::BodyForce> forces_;
};

/// Relative to the largest momentum.
[[nodiscard]] double largest_momentum_difference(const dynamics::State& a, const dynamics::State& b);

/// A point of a body, or of the world, in the world.
[[nodiscard]] Eigen::Vector3d world_point(const std::vector<dynamics::BodyPose>& poses, int body,
                                          const Eigen::Vector3d& point);

}  // namespace layfigure::testing
