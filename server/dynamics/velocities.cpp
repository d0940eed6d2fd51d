#include "layfigure/dynamics/step.h"
#include "workspace.h"

namespace layfigure::dynamics {
namespace {

const RigidGroups& groups_of(const Model& model, State& state, Workspace& workspace) {
  const RigidGroups& groups = workspace.data().groups;
  if (!groups.describes(state)) workspace.data().prepare(model, state, 1);
  return groups;
}

BodyVelocity velocity_of(const RigidGroup& group, const BodyState& carrier, const Eigen::Quaterniond& R_WC) {
  const Eigen::Vector3d spin = R_WC * spin_of(group.inertia, R_WC.conjugate() * carrier.angular_momentum);
  return {.angular = spin, .linear = carrier.linear_momentum / group.mass + spin.cross(R_WC * group.lever)};
}

BodyVelocity carried(const BodyVelocity& carrier, const Eigen::Vector3d& way) {
  return {.angular = carrier.angular, .linear = carrier.linear + carrier.angular.cross(way)};
}

BodySpeed speed_of(const BodyVelocity& velocity) {
  return {.angular = velocity.angular.norm(), .linear = velocity.linear.norm()};
}

}  // namespace

void world_velocities(const Model& model, State& state, Workspace& workspace, const std::vector<BodyPose>& poses,
                      std::vector<BodyVelocity>& velocities) {
  const RigidGroups& groups = groups_of(model, state, workspace);
  velocities.resize(model.size());
  for (const int carrier : groups.carriers()) {
    velocities[carrier] = velocity_of(groups.group(carrier), state.bodies[carrier], poses[carrier].rotation);
  }
  for (const Rider& rider : groups.riders()) {
    velocities[rider.body] = carried(velocities[rider.carrier], poses[rider.body].com - poses[rider.carrier].com);
  }
}

void world_speeds(const Model& model, State& state, Workspace& workspace, const std::vector<BodyPose>& poses,
                  std::vector<BodySpeed>& speeds) {
  const RigidGroups& groups = groups_of(model, state, workspace);
  speeds.resize(model.size());
  for (const int carrier : groups.carriers()) {
    const RigidGroup& group = groups.group(carrier);
    if (group.riders > 0) continue;
    const BodyState& body = state.bodies[carrier];
    const Eigen::Vector3d momentum = poses[carrier].rotation.conjugate() * body.angular_momentum;
    speeds[carrier] = {.angular = principal_spin_of(group.inertia, momentum).norm(),
                       .linear = body.linear_momentum.norm() / group.mass};
  }
  int carrier = -1;
  BodyVelocity velocity{.angular = Eigen::Vector3d::Zero(), .linear = Eigen::Vector3d::Zero()};
  for (const Rider& rider : groups.riders()) {
    if (rider.carrier != carrier) {
      carrier = rider.carrier;
      velocity = velocity_of(groups.group(carrier), state.bodies[carrier], poses[carrier].rotation);
      speeds[carrier] = speed_of(velocity);
    }
    speeds[rider.body] = speed_of(carried(velocity, poses[rider.body].com - poses[carrier].com));
  }
}

}  // namespace layfigure::dynamics
