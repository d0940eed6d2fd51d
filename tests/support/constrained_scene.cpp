#include "constrained_scene.h"

#include <algorithm>
#include <random>

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr unsigned kSeed = 7;

Eigen::Matrix3d box_inertia(double mass, const Eigen::Vector3d& half) {
  const Eigen::Array3d squares = half.array().square();
  return (mass / 3.0 * Eigen::Array3d(squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1]))
      .matrix()
      .asDiagonal();
}

Eigen::Vector3d in_body(const std::vector<BodyPose>& poses, int body, const Eigen::Vector3d& position) {
  if (body == kWorld) return position;
  return poses[body].rotation.conjugate() * (position - poses[body].origin);
}

/// Two bodies that touch where the first one's com is, the normal at an angle to everything.
Contact contact_at_com(const std::vector<BodyPose>& poses, int a, int b, const Eigen::Vector3d& normal, double mu) {
  Contact contact;
  contact.body_a = a;
  contact.body_b = b;
  const Eigen::Vector3d position = poses[a].com + Eigen::Vector3d(0.01, 0.02, -0.01);
  contact.point_a = in_body(poses, a, position);
  contact.point_b = in_body(poses, b, position);
  contact.normal = normal.normalized();
  contact.friction = mu;
  contact.key = static_cast<std::uint64_t>(16 * a + b + 1);
  return contact;
}

}  // namespace

ModelDefinition block(double mass, const Eigen::Vector3d& half_size, const Eigen::Vector3d& gravity) {
  ModelDefinition definition;
  definition.root = RootKind::kFree;
  definition.gravity = gravity;
  BodyDefinition& body = definition.bodies.emplace_back();
  body.name = "block";
  body.mass = mass;
  body.com = {0.0, 0.0, half_size.z()};
  body.inertia = box_inertia(mass, half_size);
  return definition;
}

std::vector<Contact> corner_contacts(const Eigen::Vector3d& half_size, double friction) {
  std::vector<Contact> contacts;
  for (int k = 0; k < 4; ++k) {
    Contact& contact = contacts.emplace_back();
    contact.point_a = {(k & 1) != 0 ? half_size.x() : -half_size.x(), (k & 2) != 0 ? half_size.y() : -half_size.y(),
                       0.0};
    contact.point_b = contact.point_a;
    contact.friction = friction;
    contact.key = static_cast<std::uint64_t>(k);
  }
  return contacts;
}

ModelDefinition bent_tree(RootKind root, double yield_torque) {
  const int parents[] = {-1, 0, 1, 1, 2, 3, 4, 5, 0};
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  ModelDefinition definition;
  definition.root = root;
  for (const int parent : parents) {
    BodyDefinition& body = definition.bodies.emplace_back();
    const int index = static_cast<int>(definition.bodies.size()) - 1;
    body.name = "limb " + std::to_string(index);
    body.parent = parent;
    body.anchor = parent < 0 ? Eigen::Vector3d(0.0, 0.0, 1.0) : Eigen::Vector3d(0.2 * vector());
    body.rotation = Eigen::Quaterniond(1.0, 0.3 * uniform(random), 0.3 * uniform(random), 0.3 * uniform(random));
    body.rotation.normalize();
    body.mass = 0.3 + 0.2 * uniform(random);
    body.com = 0.1 * vector();
    body.inertia = box_inertia(body.mass, {0.05, 0.08, 0.12});
    body.joint.stiffness = 3.0;
    body.joint.damping = 0.05;
    body.joint.flow_damping = 0.1;
    body.joint.yield_torque = yield_torque;
    if (index % 2 == 1) {
      body.joint.shape.stiffness = {0.5, 1.0, 2.0};
      body.joint.shape.yield = {0.7, 1.0, 1.5};
      body.joint.shape.axes = Eigen::Quaterniond(0.8, 0.2, -0.4, 0.4).normalized();
    }
    if (index == 4) {
      body.joint.shape.locked = {false, true, false};
      body.rest_rotation = body.rotation;
    }
  }
  return definition;
}

std::vector<Contact> tree_contacts(const Model& model, const State& state) {
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  return {contact_at_com(poses, 4, kWorld, {0.1, 0.2, 1.0}, 0.5),
          contact_at_com(poses, 7, kWorld, {-0.2, 0.0, 1.0}, 0.1), contact_at_com(poses, 6, 7, {0.3, -0.2, 1.0}, 0.3),
          contact_at_com(poses, 5, 8, {0.0, 0.5, -1.0}, 0.0), contact_at_com(poses, 2, 0, {1.0, 0.0, 0.3}, 0.8)};
}

std::vector<Tie> tree_ties(const Model& model, const State& state) {
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  Tie loop{.body_a = 6, .body_b = 8};
  loop.point_a = model.body(6).com;
  loop.point_b = in_body(poses, 8, poses[6].com + Eigen::Vector3d(0.001, 0.0, -0.002));
  Tie hook{.body_a = 5};
  hook.point_a = {0.03, 0.0, 0.01};
  hook.point_b = world_point(poses, 5, hook.point_a);
  hook.stiffness = 400.0;
  hook.damping = 3.0;
  hook.holds_rotation = true;
  hook.rotation = poses[5].rotation * Eigen::Quaterniond(1.0, 0.01, 0.0, -0.02).normalized();
  return {loop, hook};
}

ReplayedForces::ReplayedForces(const Model& model, const State& before, const std::vector<Contact>& contacts,
                               const std::vector<Tie>& ties, const Workspace& workspace) {
  world_poses(model, before, poses_);
  forces_.resize(model.size());
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const Eigen::Vector3d& force = workspace.contact_force(static_cast<int>(k));
    const Contact& contact = contacts[k];
    add_force(contact.body_a, world_point(poses_, contact.body_a, contact.point_a), force);
    add_force(contact.body_b, world_point(poses_, contact.body_b, contact.point_b), -force);
  }
  for (std::size_t k = 0; k < ties.size(); ++k) {
    const BodyForce& exerted = workspace.tie_force(static_cast<int>(k));
    const Tie& tie = ties[k];
    add_force(tie.body_a, world_point(poses_, tie.body_a, tie.point_a), exerted.force);
    add_force(tie.body_b, world_point(poses_, tie.body_b, tie.point_b), -exerted.force);
    forces_[tie.body_a].torque += exerted.torque;
    if (tie.body_b != kWorld) forces_[tie.body_b].torque -= exerted.torque;
  }
}

void ReplayedForces::add_force(int body, const Eigen::Vector3d& position, const Eigen::Vector3d& force) {
  if (body == kWorld) return;
  forces_[body].force += force;
  forces_[body].torque += (position - poses_[body].com).cross(force);
}

void ReplayedForces::add(double, std::span<BodyForce> forces) const {
  for (std::size_t i = 0; i < forces.size(); ++i) {
    forces[i].force += forces_[i].force;
    forces[i].torque += forces_[i].torque;
  }
}

double largest_momentum_difference(const State& a, const State& b) {
  double difference = 0.0;
  double largest = 0.0;
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    const BodyState& x = a.bodies[i];
    const BodyState& y = b.bodies[i];
    difference = std::max(
        {difference, (x.linear_momentum - y.linear_momentum).norm(), (x.angular_momentum - y.angular_momentum).norm()});
    largest = std::max({largest, x.linear_momentum.norm(), x.angular_momentum.norm()});
  }
  return difference / largest;
}

Eigen::Vector3d world_point(const std::vector<BodyPose>& poses, int body, const Eigen::Vector3d& point) {
  return body == kWorld ? point : Eigen::Vector3d(poses[body].origin + poses[body].rotation * point);
}

}  // namespace layfigure::testing
