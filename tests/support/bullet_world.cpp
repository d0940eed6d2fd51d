#include "bullet_world.h"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyMLCPConstraintSolver.h>
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <optional>
#include <stdexcept>

#include "bullet_shapes.h"
#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

// Bullet clamps joint velocities to 100 rad/s by default, which would be another problem than the scene's.
constexpr btScalar kNoVelocityLimit = 1e18F;

Eigen::Vector3d to_eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

/// R_PB of a spherical joint from Bullet's x y z w.
Eigen::Quaterniond joint_rotation(const btMultiBody& multi, int link) {
  const btScalar* q = multi.getJointPosMultiDof(link);
  return {q[3], q[0], q[1], q[2]};
}

std::unique_ptr<btMultiBody> base_of(const dynamics::ModelDefinition& definition) {
  const int first = first_link(definition);
  const int links = static_cast<int>(definition.bodies.size()) - first;
  if (first == 0) return std::make_unique<btMultiBody>(links, 0, btVector3(0, 0, 0), /*fixedBase=*/true, false);
  const dynamics::BodyDefinition& root = definition.bodies.front();
  auto multi = std::make_unique<btMultiBody>(links, static_cast<btScalar>(root.mass),
                                             to_bullet(root.inertia.diagonal()), /*fixedBase=*/false, false);
  const Eigen::Vector3d com = root.anchor + root.rotation * root.com;
  multi->setBaseWorldTransform(btTransform(to_bullet(root.rotation), to_bullet(com)));
  return multi;
}

std::unique_ptr<btMultiBody> multi_body_of(const dynamics::ModelDefinition& definition) {
  const auto& bodies = definition.bodies;
  const int first = first_link(definition);
  auto multi = base_of(definition);
  for (int i = first; i < static_cast<int>(bodies.size()); ++i) {
    const auto& body = bodies[i];
    const Eigen::Vector3d parent_com = body.parent < 0 ? Eigen::Vector3d::Zero() : bodies[body.parent].com;
    multi->setupSpherical(i - first, static_cast<btScalar>(body.mass), to_bullet(body.inertia.diagonal()),
                          body.parent - first, btQuaternion::getIdentity(), to_bullet(body.anchor - parent_com),
                          to_bullet(body.com), true);
  }
  multi->finalizeMultiDof();
  multi->setLinearDamping(0);
  multi->setAngularDamping(0);
  multi->setUseGyroTerm(true);
  multi->setMaxCoordinateVelocity(kNoVelocityLimit);
  for (int i = first; i < static_cast<int>(bodies.size()); ++i) {
    const btQuaternion rotation = to_bullet(bodies[i].rotation);
    multi->setJointPosMultiDof(i - first, static_cast<const btScalar*>(rotation));
  }
  return multi;
}

void require_representable(const Scene& scene) {
  for (const Pull& pull : scene.pulls) {
    if (pull.shape != Pull::Shape::kConstant || pull.start > 0.0 || pull.end < scene.duration) {
      throw std::runtime_error(scene.name + ": the Bullet peer takes constant loads alone");
    }
  }
  int roots = 0;
  for (const auto& body : scene.definition.bodies) {
    roots += body.parent < 0 ? 1 : 0;
    if (std::isfinite(body.joint.yield_torque)) {
      throw std::runtime_error(scene.name + ": the Bullet peer has no joints that yield");
    }
  }
  if (first_link(scene.definition) == 1 && roots > 1) {
    throw std::runtime_error(scene.name + ": the Bullet peer takes one free root");
  }
}

std::unique_ptr<btMultiBodyConstraintSolver> make_solver(BulletSolver solver, btDantzigSolver& dantzig) {
  if (solver == BulletSolver::kDantzig) return std::make_unique<btMultiBodyMLCPConstraintSolver>(&dantzig);
  return std::make_unique<btMultiBodyConstraintSolver>();
}

}  // namespace

struct BulletWorld::Impl {
  Impl(const Scene& scene, BulletSolver solver_kind)
      : bodies(scene.definition.bodies),
        first(first_link(scene.definition)),
        pulls(scene.pulls),
        gravity(scene.definition.gravity),
        solver(make_solver(solver_kind, dantzig)),
        multi(multi_body_of(scene.definition)) {
    world.setGravity(to_bullet(gravity));
    world.addMultiBody(multi.get());
    if (!scene.floor) return;
    shapes.emplace(scene, *multi, world);
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> positions;
    multi->forwardKinematics(rotations, positions);
    multi->updateCollisionObjectWorldTransforms(rotations, positions);
  }
  ~Impl() { world.removeMultiBody(multi.get()); }

  void apply_joint_torques() {
    for (int i = 0; i < multi->getNumLinks(); ++i) {
      const btScalar* w = multi->getJointVelMultiDof(i);
      const Eigen::Vector3d strain = math::log_rotation(joint_rotation(*multi, i));
      const auto& joint = bodies[i + first].joint;
      const btVector3 torque = to_bullet(-joint.stiffness * strain - joint.damping * Eigen::Vector3d(w[0], w[1], w[2]));
      multi->addJointTorqueMultiDof(i, static_cast<const btScalar*>(torque));
    }
  }

  void apply_loads() {
    for (const Pull& pull : pulls) {
      const int link = pull.body - first;
      link < 0 ? multi->addBaseForce(to_bullet(pull.force)) : multi->addLinkForce(link, to_bullet(pull.force));
    }
  }

  const std::vector<dynamics::BodyDefinition> bodies;
  const int first;
  const std::vector<Pull> pulls;
  const Eigen::Vector3d gravity;
  double h{0.0};  ///< of the last step [s]
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDantzigSolver dantzig;
  std::unique_ptr<btMultiBodyConstraintSolver> solver;
  btMultiBodyDynamicsWorld world{&dispatcher, &broadphase, solver.get(), &configuration};
  std::unique_ptr<btMultiBody> multi;
  std::optional<BulletShapes> shapes;
};

BulletWorld::BulletWorld(const Scene& scene, BulletSolver solver) {
  require_representable(scene);
  impl_ = std::make_unique<Impl>(scene, solver);
}

BulletWorld::~BulletWorld() = default;

void BulletWorld::step(double h) {
  impl_->apply_joint_torques();
  impl_->apply_loads();
  impl_->world.stepSimulation(static_cast<btScalar>(h), /*maxSubSteps=*/0);
  impl_->h = h;
}

std::vector<dynamics::BodyPose> BulletWorld::poses() {
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> positions;
  impl_->multi->forwardKinematics(rotations, positions);
  std::vector<dynamics::BodyPose> poses;
  for (int i = 0; i < static_cast<int>(impl_->bodies.size()); ++i) {
    const int link = i - impl_->first;
    const btTransform transform =
        link < 0 ? impl_->multi->getBaseWorldTransform() : impl_->multi->getLink(link).m_cachedWorldTransform;
    const btQuaternion q = transform.getRotation();
    const Eigen::Quaterniond rotation(q.w(), q.x(), q.y(), q.z());
    const Eigen::Vector3d com = to_eigen(transform.getOrigin());
    poses.push_back({.rotation = rotation, .origin = com - rotation * impl_->bodies[i].com, .com = com});
  }
  return poses;
}

double BulletWorld::kinetic_energy() {
  // Bullet numbers the base 0 and the links from 1 here; each link's velocities are in its own axes.
  std::vector<btVector3> w(impl_->multi->getNumLinks() + 1), v(w.size());
  impl_->multi->compTreeLinkVelocities(w.data(), v.data());
  double energy = 0.0;
  for (std::size_t i = 0; i < impl_->bodies.size(); ++i) {
    const auto& body = impl_->bodies[i];
    const std::size_t number = i + 1 - impl_->first;
    const Eigen::Vector3d rate = to_eigen(w[number]);
    energy += 0.5 * body.mass * to_eigen(v[number]).squaredNorm() + 0.5 * rate.dot(body.inertia * rate);
  }
  return energy;
}

double BulletWorld::energy() {
  const std::vector<dynamics::BodyPose> all = poses();
  double energy = kinetic_energy();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto& body = impl_->bodies[i];
    const int link = static_cast<int>(i) - impl_->first;
    energy -= body.mass * impl_->gravity.dot(all[i].com);
    if (link < 0) continue;
    energy += 0.5 * body.joint.stiffness * math::log_rotation(joint_rotation(*impl_->multi, link)).squaredNorm();
  }
  return energy;
}

double BulletWorld::support() { return impl_->shapes ? impl_->shapes->vertical_impulse() / impl_->h : 0.0; }

BulletResult run_bullet(const Scene& scene, int steps, BulletSolver solver) {
  BulletWorld world(scene, solver);
  const double h = scene.duration / steps;
  const WatchedSteps watched = watch_steps(
      scene, steps, [&](int) { world.step(h); }, [&] { return world.poses(); });
  BulletResult result{.coms = {}, .energy = world.energy(), .cpu_seconds = watched.cpu_seconds, .touch = {}};
  for (const dynamics::BodyPose& pose : world.poses()) result.coms.push_back(pose.com);
  result.finite = std::isfinite(result.energy);
  result.touch = {.penetration = watched.penetration, .kinetic = world.kinetic_energy(), .support = world.support()};
  return result;
}

}  // namespace layfigure::testing
