#include "bullet_shapes.h"

#include "floor_scene.h"

namespace layfigure::testing {
namespace {

// Collision filters.
constexpr int kFloor = 1;
constexpr int kLimb = 2;

}  // namespace

btVector3 to_bullet(const Eigen::Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

btQuaternion to_bullet(const Eigen::Quaterniond& q) {
  const Eigen::Vector4f xyzw = q.cast<float>().coeffs();
  return {xyzw[0], xyzw[1], xyzw[2], xyzw[3]};
}

int first_link(const dynamics::ModelDefinition& definition) {
  return definition.root == dynamics::RootKind::kFree ? 1 : 0;
}

BulletShapes::BulletShapes(const Scene& scene, btMultiBody& multi, btMultiBodyDynamicsWorld& world) : world_(world) {
  floor_.setCollisionShape(&plane_);
  // Bullet multiplies the two coefficients.
  floor_.setFriction(1);
  world.addCollisionObject(&floor_, kFloor, kLimb);
  for (int i = 0; i < static_cast<int>(scene.definition.bodies.size()); ++i) add_body(scene, multi, i);
}

BulletShapes::~BulletShapes() {
  for (const auto& collider : colliders_) world_.removeCollisionObject(collider.get());
  world_.removeCollisionObject(&floor_);
}

void BulletShapes::add_body(const Scene& scene, btMultiBody& multi, int body) {
  auto compound = std::make_unique<btCompoundShape>();
  for (const Limb& limb : scene.limbs) {
    if (limb.body == body) add_limb(limb, scene.definition.bodies[body].com, *compound);
  }
  if (compound->getNumChildShapes() == 0) return;
  const int link = body - first_link(scene.definition);
  auto collider = std::make_unique<btMultiBodyLinkCollider>(&multi, link);
  collider->setCollisionShape(compound.get());
  collider->setFriction(static_cast<btScalar>(*scene.floor));
  collider->setActivationState(DISABLE_DEACTIVATION);
  if (link < 0) {
    multi.setBaseCollider(collider.get());
  } else {
    multi.getLink(link).m_collider = collider.get();
  }
  world_.addCollisionObject(collider.get(), kLimb, kFloor);
  shapes_.push_back(std::move(compound));
  colliders_.push_back(std::move(collider));
}

void BulletShapes::add_limb(const Limb& limb, const Eigen::Vector3d& com, btCompoundShape& compound) {
  const double length = (limb.to - limb.from).norm();
  auto capsule = std::make_unique<btCapsuleShapeZ>(static_cast<btScalar>(limb.radius), static_cast<btScalar>(length));
  const Eigen::Vector3d center = 0.5 * (limb.from + limb.to) - com;
  compound.addChildShape(btTransform(to_bullet(limb_rotation(limb)), to_bullet(center)), capsule.get());
  shapes_.push_back(std::move(capsule));
}

double BulletShapes::vertical_impulse() const {
  double impulse = 0.0;
  btDispatcher& dispatcher = *world_.getDispatcher();
  for (int k = 0; k < dispatcher.getNumManifolds(); ++k) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(k);
    // A contact's normal points to its first object.
    const double sign = manifold.getBody0() == &floor_ ? -1.0 : 1.0;
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold.getContactPoint(i);
      impulse += sign * point.getAppliedImpulse() * point.m_normalWorldOnB.z();
    }
  }
  return impulse;
}

}  // namespace layfigure::testing
