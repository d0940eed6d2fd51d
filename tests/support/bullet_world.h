#pragma once

#include <memory>
#include <vector>

#include "floor_scene.h"
#include "scene.h"

namespace layfigure::testing {

/// What solves Bullet's contacts.
enum class BulletSolver {
  kSequentialImpulses,  ///< btMultiBodyConstraintSolver, its default
  kDantzig,             ///< btMultiBodyMLCPConstraintSolver with btDantzigSolver
};

/// A scene in Bullet's btMultiBody, an independent engine: Featherstone's forward dynamics, explicit velocity-product
/// terms, and the torque of each joint's spring-damper applied explicitly at the beginning of each step. Debian builds
/// Bullet in single precision, so it cannot come nearer than some 1e-5 m. Constant loads alone, no flow: it throws
/// std::runtime_error for a scene that has others. Contacts with the floor are Bullet's own, at its default settings.
/// Not thread safe.
class BulletWorld {
 public:
  explicit BulletWorld(const Scene& scene, BulletSolver solver = BulletSolver::kSequentialImpulses);
  ~BulletWorld();
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  /// One step of h [s].
  void step(double h);
  /// World poses of the bodies.
  [[nodiscard]] std::vector<dynamics::BodyPose> poses();
  /// [J]
  [[nodiscard]] double kinetic_energy();
  /// Kinetic energy, gravity's potential relative to the origin, and the springs' [J].
  [[nodiscard]] double energy();
  /// Vertical sum of what the floor exerted in the last step, by the contacts' impulses [N].
  [[nodiscard]] double support();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Steps the scene to its end by Bullet, with `steps` equal steps.
struct BulletResult {
  std::vector<Eigen::Vector3d> coms;  ///< world [m]
  double energy{0.0};                 ///< [J]
  bool finite{true};
  double cpu_seconds{0.0};  ///< of the stepping alone, by the thread's CPU clock
  Touch touch;              ///< of a scene that has a floor
};
[[nodiscard]] BulletResult run_bullet(const Scene& scene, int steps,
                                      BulletSolver solver = BulletSolver::kSequentialImpulses);

}  // namespace layfigure::testing
