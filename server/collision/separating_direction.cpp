#include "separating_direction.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

namespace layfigure::collision {
namespace {

// Hulls that overlap by less than a tenth of their size still have cores apart, for which GJK's direction is good to
// 1e-5; it is lost where a distance is of the order of single precision's rounding.
constexpr double kShrink = 0.9;

btVector3 to_bullet_vector(const Eigen::Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

btMatrix3x3 to_bullet_matrix(const Eigen::Matrix3d& m) {
  const Eigen::Matrix<btScalar, 3, 3> f = m.cast<btScalar>();
  return {f(0, 0), f(0, 1), f(0, 2), f(1, 0), f(1, 1), f(1, 2), f(2, 0), f(2, 1), f(2, 2)};
}

}  // namespace

struct ShrunkCore::Hull {
  Eigen::Vector3d center;
  btConvexHullShape shape;  // about its centre: the smaller the numbers, the more digits are left
};

ShrunkCore::ShrunkCore(const Polytope& core) : hull_(std::make_unique<Hull>()) {
  hull_->center = core.center;
  for (const auto& v : core.vertices) hull_->shape.addPoint(to_bullet_vector(kShrink * (v - core.center)), false);
  hull_->shape.setMargin(0);
  hull_->shape.recalcLocalAabb();
}
ShrunkCore::~ShrunkCore() = default;
ShrunkCore::ShrunkCore(ShrunkCore&&) noexcept = default;
ShrunkCore& ShrunkCore::operator=(ShrunkCore&&) noexcept = default;

Eigen::Vector3d separating_direction(const ShrunkCore& a, const ShrunkCore& b, const Eigen::Matrix3d& R_AB,
                                     const Eigen::Vector3d& p_AB) {
  const Eigen::Vector3d p_ab = R_AB * b.hull().center + p_AB - a.hull().center;
  const btTransform at_a = btTransform::getIdentity();
  const btTransform at_b(to_bullet_matrix(R_AB), to_bullet_vector(p_ab));
  const btConvexShape* shape_a = &a.hull().shape;
  const btConvexShape* shape_b = &b.hull().shape;
  btGjkEpaSolver2::sResults found;
  const bool done = btGjkEpaSolver2::Distance(shape_a, at_a, shape_b, at_b, to_bullet_vector(p_ab), found) ||
                    btGjkEpaSolver2::Penetration(shape_a, at_a, shape_b, at_b, to_bullet_vector(p_ab), found, false);
  if (!done) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d direction(found.normal.x(), found.normal.y(), found.normal.z());
  const double length = direction.norm();
  if (!(length > 0.5)) return Eigen::Vector3d::Zero();
  return direction / length;
}

}  // namespace layfigure::collision
