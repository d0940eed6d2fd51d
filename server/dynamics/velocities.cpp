#include "layfigure/dynamics/step.h"
#include "workspace.h"

namespace layfigure::dynamics {

void world_velocities(const Model& model, State& state, Workspace& workspace, const std::vector<BodyPose>& poses,
                      std::vector<BodyVelocity>& velocities) {
  RigidGroups& groups = workspace.data().groups;
  if (!groups.describes(state)) workspace.data().prepare(model, state, 1);
  velocities.resize(model.size());
  for (const int carrier : groups.carriers()) {
    const RigidGroup& group = groups.group(carrier);
    const BodyState& body = state.bodies[carrier];
    const Eigen::Quaterniond& R_WC = poses[carrier].rotation;
    const Eigen::Vector3d spin = R_WC * spin_of(group.inertia, R_WC.conjugate() * body.angular_momentum);
    velocities[carrier] = {.angular = spin,
                           .linear = body.linear_momentum / group.mass + spin.cross(R_WC * group.lever)};
  }
  for (const Rider& rider : groups.riders()) {
    const BodyVelocity& carrier = velocities[rider.carrier];
    const Eigen::Vector3d way = poses[rider.body].com - poses[rider.carrier].com;
    velocities[rider.body] = {.angular = carrier.angular, .linear = carrier.linear + carrier.angular.cross(way)};
  }
}

}  // namespace layfigure::dynamics
