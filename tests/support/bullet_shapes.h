#pragma once

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

#include "scene.h"

/// A scene's shapes in Bullet's collision detection.
namespace layfigure::testing {

[[nodiscard]] btVector3 to_bullet(const Eigen::Vector3d& v);
[[nodiscard]] btQuaternion to_bullet(const Eigen::Quaterniond& q);

/// A free root is the base of Bullet's multi-body; its links are the bodies from this one on.
[[nodiscard]] int first_link(const dynamics::ModelDefinition& definition);

/// The floor and the limbs, in `world` as long as this lives. Limbs meet the floor alone.
class BulletShapes {
 public:
  BulletShapes(const Scene& scene, btMultiBody& multi, btMultiBodyDynamicsWorld& world);
  ~BulletShapes();
  BulletShapes(const BulletShapes&) = delete;
  BulletShapes& operator=(const BulletShapes&) = delete;

  /// What the floor exerted in the last step, vertical, by the contacts' impulses [N s].
  [[nodiscard]] double vertical_impulse() const;

 private:
  void add_body(const Scene& scene, btMultiBody& multi, int body);
  void add_limb(const Limb& limb, const Eigen::Vector3d& com, btCompoundShape& compound);

  btMultiBodyDynamicsWorld& world_;
  btStaticPlaneShape plane_{btVector3(0, 0, 1), 0};
  btCollisionObject floor_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
};

}  // namespace layfigure::testing
