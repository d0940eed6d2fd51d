// The same chain in Bullet's btMultiBody: an independent engine in single precision, so agreement is to a millimetre.
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <memory>

#include "layfigure/math/rotation.h"
#include "scene.h"

namespace layfigure::testing {
namespace {

constexpr double kTolerance = 2e-3;  // m; Bullet's explicit step at 0.1 ms in single precision

btVector3 to_bullet(const Eigen::Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

/// World positions of the links' coms after `duration`, by Bullet.
std::vector<Eigen::Vector3d> bullet_coms(const Scene& scene, double duration, double h) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(to_bullet(scene.definition.gravity));
  const auto& bodies = scene.definition.bodies;
  auto multi = std::make_unique<btMultiBody>(static_cast<int>(bodies.size()), 0, btVector3(0, 0, 0), true, false);
  for (int i = 0; i < static_cast<int>(bodies.size()); ++i) {
    const auto& body = bodies[i];
    const Eigen::Vector3d parent_com = body.parent < 0 ? Eigen::Vector3d::Zero() : bodies[body.parent].com;
    multi->setupSpherical(i, static_cast<btScalar>(body.mass), to_bullet(body.inertia.diagonal()), body.parent,
                          btQuaternion::getIdentity(), to_bullet(body.anchor - parent_com), to_bullet(body.com), true);
  }
  multi->finalizeMultiDof();
  multi->setLinearDamping(0);
  multi->setAngularDamping(0);
  multi->setUseGyroTerm(true);
  world.addMultiBody(multi.get());
  for (int k = 0; k < static_cast<int>(std::lround(duration / h)); ++k) {
    world.stepSimulation(static_cast<btScalar>(h), 0);
  }
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> positions;
  multi->forwardKinematics(rotations, positions);
  std::vector<Eigen::Vector3d> coms;
  for (int i = 0; i < multi->getNumLinks(); ++i) {
    const btVector3& p = multi->getLink(i).m_cachedWorldTransform.getOrigin();
    coms.emplace_back(p.x(), p.y(), p.z());
  }
  world.removeMultiBody(multi.get());
  return coms;
}

TEST(Bullet, LooseChainFalling_AgreesWithBtMultiBody) {
  Scene scene = chain({.links = 4, .stiffness = 0.0, .damping = 0.0});
  scene.definition.gravity = {0.0, 2.0, -9.0};
  scene.duration = 0.25;
  const auto theirs = bullet_coms(scene, scene.duration, 1e-4);
  const auto ours = run_scene(scene, dynamics::Model(scene.definition), 500, 4).coms;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    EXPECT_LT((ours[i] - theirs[i]).norm(), kTolerance) << "link " << i;
    EXPECT_GT((ours[i] - Eigen::Vector3d(0.05 + 0.1 * static_cast<double>(i), 0.0, 0.0)).norm(), 0.01)
        << "it must have moved";
  }
}

}  // namespace
}  // namespace layfigure::testing
