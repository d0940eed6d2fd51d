#include "bullet_world.h"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <stdexcept>

#include "cpu_clock.h"
#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

// Bullet clamps joint velocities to 100 rad/s by default, which would be another problem than the scene's.
constexpr btScalar kNoVelocityLimit = 1e18F;

btVector3 to_bullet(const Eigen::Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

Eigen::Vector3d to_eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

/// R_PB of a spherical joint from Bullet's x y z w.
Eigen::Quaterniond joint_rotation(const btMultiBody& multi, int link) {
  const btScalar* q = multi.getJointPosMultiDof(link);
  return {q[3], q[0], q[1], q[2]};
}

std::unique_ptr<btMultiBody> multi_body_of(const std::vector<dynamics::BodyDefinition>& bodies) {
  const int n = static_cast<int>(bodies.size());
  auto multi = std::make_unique<btMultiBody>(n, 0, btVector3(0, 0, 0), /*fixedBase=*/true, /*canSleep=*/false);
  for (int i = 0; i < n; ++i) {
    const auto& body = bodies[i];
    const Eigen::Vector3d parent_com = body.parent < 0 ? Eigen::Vector3d::Zero() : bodies[body.parent].com;
    multi->setupSpherical(i, static_cast<btScalar>(body.mass), to_bullet(body.inertia.diagonal()), body.parent,
                          btQuaternion::getIdentity(), to_bullet(body.anchor - parent_com), to_bullet(body.com), true);
  }
  multi->finalizeMultiDof();
  multi->setLinearDamping(0);
  multi->setAngularDamping(0);
  multi->setUseGyroTerm(true);
  multi->setMaxCoordinateVelocity(kNoVelocityLimit);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector4f xyzw = bodies[i].rotation.cast<float>().coeffs();
    multi->setJointPosMultiDof(i, xyzw.data());
  }
  return multi;
}

void require_elastic(const Scene& scene) {
  if (!scene.pulls.empty()) throw std::runtime_error(scene.name + ": the Bullet peer takes no loads");
  for (const auto& body : scene.definition.bodies) {
    if (std::isfinite(body.joint.yield_torque)) {
      throw std::runtime_error(scene.name + ": the Bullet peer has no joints that yield");
    }
  }
}

}  // namespace

struct BulletWorld::Impl {
  explicit Impl(const Scene& scene)
      : bodies(scene.definition.bodies), gravity(scene.definition.gravity), multi(multi_body_of(bodies)) {
    world.setGravity(to_bullet(gravity));
    world.addMultiBody(multi.get());
  }
  ~Impl() { world.removeMultiBody(multi.get()); }

  void apply_joint_torques() {
    for (int i = 0; i < multi->getNumLinks(); ++i) {
      const btScalar* w = multi->getJointVelMultiDof(i);
      const Eigen::Vector3d strain = math::log_rotation(joint_rotation(*multi, i));
      const auto& joint = bodies[i].joint;
      const btVector3 torque = to_bullet(-joint.stiffness * strain - joint.damping * Eigen::Vector3d(w[0], w[1], w[2]));
      multi->addJointTorqueMultiDof(i, static_cast<const btScalar*>(torque));
    }
  }

  const std::vector<dynamics::BodyDefinition> bodies;
  const Eigen::Vector3d gravity;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::unique_ptr<btMultiBody> multi;
};

BulletWorld::BulletWorld(const Scene& scene) {
  require_elastic(scene);
  impl_ = std::make_unique<Impl>(scene);
}

BulletWorld::~BulletWorld() = default;

void BulletWorld::step(double h) {
  impl_->apply_joint_torques();
  impl_->world.stepSimulation(static_cast<btScalar>(h), /*maxSubSteps=*/0);
}

std::vector<Eigen::Vector3d> BulletWorld::coms() {
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> positions;
  impl_->multi->forwardKinematics(rotations, positions);
  std::vector<Eigen::Vector3d> coms;
  for (int i = 0; i < impl_->multi->getNumLinks(); ++i) {
    coms.push_back(to_eigen(impl_->multi->getLink(i).m_cachedWorldTransform.getOrigin()));
  }
  return coms;
}

double BulletWorld::energy() {
  const std::vector<Eigen::Vector3d> positions = coms();
  // Bullet numbers the base 0 and the links from 1 here; each link's velocities are in its own axes.
  std::vector<btVector3> w(positions.size() + 1), v(positions.size() + 1);
  impl_->multi->compTreeLinkVelocities(w.data(), v.data());
  double energy = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto& body = impl_->bodies[i];
    const Eigen::Vector3d rate = to_eigen(w[i + 1]);
    const double strain = math::log_rotation(joint_rotation(*impl_->multi, static_cast<int>(i))).norm();
    energy += 0.5 * body.mass * to_eigen(v[i + 1]).squaredNorm() + 0.5 * rate.dot(body.inertia * rate) -
              body.mass * impl_->gravity.dot(positions[i]) + 0.5 * body.joint.stiffness * strain * strain;
  }
  return energy;
}

BulletResult run_bullet(const Scene& scene, int steps) {
  BulletWorld world(scene);
  const double h = scene.duration / steps;
  const double start = thread_cpu_seconds();
  for (int k = 0; k < steps; ++k) world.step(h);
  BulletResult result{.coms = {}, .cpu_seconds = thread_cpu_seconds() - start};
  result.coms = world.coms();
  result.energy = world.energy();
  result.finite = std::isfinite(result.energy);
  return result;
}

}  // namespace layfigure::testing
