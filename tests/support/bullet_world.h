#pragma once

#include <memory>
#include <vector>

#include "scene.h"

namespace layfigure::testing {

/// A scene in Bullet's btMultiBody, an independent engine: Featherstone's forward dynamics, explicit velocity-product
/// terms, and the torque of each joint's spring-damper applied explicitly at the beginning of each step. Debian builds
/// Bullet in single precision, so it cannot come nearer than some 1e-5 m. No loads, no flow: it throws
/// std::runtime_error for a scene that has them. Not thread safe.
class BulletWorld {
 public:
  explicit BulletWorld(const Scene& scene);
  ~BulletWorld();
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  /// One step of h [s].
  void step(double h);
  /// World positions of the bodies' coms [m].
  [[nodiscard]] std::vector<Eigen::Vector3d> coms();
  /// Kinetic energy, gravity's potential relative to the origin, and the springs' [J].
  [[nodiscard]] double energy();

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
};
[[nodiscard]] BulletResult run_bullet(const Scene& scene, int steps);

}  // namespace layfigure::testing
