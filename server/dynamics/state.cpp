#include "layfigure/dynamics/state.h"

#include "axis_law.h"
#include "layfigure/math/rotation.h"
#include "rigid_groups.h"

namespace layfigure::dynamics {
namespace {

double strain_of(const BodyState& body) {
  return math::log_rotation(body.rest_rotation.conjugate() * body.rotation).norm();
}

double rotational_energy(const PrincipalInertia& inertia, const Eigen::Vector3d& momentum_B) {
  return 0.5 * (inertia.axes.transpose() * momentum_B).cwiseAbs2().cwiseQuotient(inertia.moments).sum();
}

}  // namespace

State initial_state(const Model& model) {
  State state;
  state.bodies.reserve(model.size());
  for (int i = 0; i < model.size(); ++i) {
    const BodyDefinition& body = model.body(i);
    state.bodies.push_back({.rotation = body.rotation,
                            .rest_rotation = body.rest_rotation,
                            .linear_momentum = Eigen::Vector3d::Zero(),
                            .flow = 0.0,
                            .angular_momentum = Eigen::Vector3d::Zero(),
                            .yield_scale = 1.0,
                            .trial_torque = Eigen::Vector3d::Zero(),
                            .limit_slack = 0.0,
                            .torque = Eigen::Vector3d::Zero(),
                            .rest_time = 0.0,
                            .position = body.anchor,
                            .yielding = false,
                            .asleep = false});
    BodyState& now = state.bodies.back();
    now.asleep = body.parent >= 0 && is_welded(body.joint) && strain_of(now) <= 1.0 / kRigidStiffness;
  }
  return state;
}

void wake(const Model& model, State& state) {
  RigidGroups groups(model);
  groups.assign(model, state);
  std::vector<char> asleep(model.size());
  for (int i = 0; i < model.size(); ++i) asleep[i] = state.bodies[i].asleep && is_welded(model.body(i).joint) ? 1 : 0;
  groups.regroup(model, state, asleep);
  for (BodyState& body : state.bodies) body.rest_time = 0.0;
  state.rest = {};
}

void world_poses(const Model& model, const State& state, std::vector<BodyPose>& poses) {
  poses.resize(model.size());
  for (int i = 0; i < model.size(); ++i) {
    const BodyDefinition& body = model.body(i);
    const BodyState& now = state.bodies[i];
    BodyPose& pose = poses[i];
    if (body.parent < 0) {
      pose.rotation = now.rotation;
      pose.origin = now.position;
    } else {
      const BodyPose& parent = poses[body.parent];
      pose.rotation = (parent.rotation * now.rotation).normalized();
      pose.origin = parent.origin + parent.rotation * body.anchor;
    }
    pose.com = pose.origin + pose.rotation * body.com;
  }
}

Energy energy(const Model& model, const State& state) {
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  std::vector<double> reach(model.size());
  State united = state;
  RigidGroups groups(model);
  groups.assign(model, united);
  Energy sum{.kinetic = 0.0, .gravitational = 0.0, .elastic = 0.0, .rounding = 0.0};
  for (int i = 0; i < model.size(); ++i) {
    const BodyDefinition& body = model.body(i);
    const BodyState& now = state.bodies[i];
    if (!groups.rides(i)) {
      const RigidGroup& group = groups.group(i);
      const BodyState& moving = united.bodies[i];
      sum.kinetic += 0.5 * moving.linear_momentum.squaredNorm() / group.mass;
      sum.kinetic += rotational_energy(group.inertia, poses[i].rotation.conjugate() * moving.angular_momentum);
    }
    sum.gravitational -= body.mass * model.gravity().dot(poses[i].com);
    // The errors of a position are those of the whole way to it.
    reach[i] = body.parent < 0 ? now.position.norm() : reach[body.parent] + body.anchor.norm();
    sum.rounding += kEnergyRounding * body.mass * model.gravity().norm() * (reach[i] + body.com.norm());
    if (body.parent >= 0 || model.root() == RootKind::kBall) {
      const Eigen::Vector3d strain = math::log_rotation(now.rest_rotation.conjugate() * now.rotation);
      const Eigen::Vector3d along = body.joint.shape.axes.conjugate() * strain;
      const Eigen::Vector3d torque = axis_stiffness(body.joint).cwiseProduct(along);
      sum.elastic += 0.5 * along.dot(torque);
      sum.rounding += kAngleRounding * (torque.lpNorm<1>() + kAngleRounding * axis_stiffness(body.joint).sum());
    }
  }
  sum.rounding += kEnergyRounding * (sum.kinetic + sum.elastic);
  return sum;
}

}  // namespace layfigure::dynamics
