#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "layfigure/scene/scene.h"

namespace layfigure::testing {

/// A scene and what is done to it. Copies, files and shrinking keep all of it.
struct StressScene {
  std::uint64_t seed{0};
  scene::SceneDefinition definition;
  std::vector<Eigen::Vector3d> spins;                 ///< angular velocity of each body at the start [rad/s]
  std::vector<dynamics::BodyForce> forces;            ///< constant, one per body
  std::vector<dynamics::Coupling> couplings;          ///< their targets jump by `teleport` half way
  Eigen::Vector3d teleport{Eigen::Vector3d::Zero()};  ///< [m]
  std::vector<dynamics::Tie> ties;
  std::vector<dynamics::Drive> drives;
  double softness{1.0};     ///< scales all yield torques from a third of the way on
  double sleep_angle{0.0};  ///< [rad]
  double h{1e-3};           ///< [s]
  int steps{12};
  int order{1};
};

/// Those of a scene, as its loads.
class ConstantForces : public dynamics::Loads {
 public:
  explicit ConstantForces(const std::vector<dynamics::BodyForce>& forces) : forces_(forces) {}
  void add(double, std::span<dynamics::BodyForce> forces) const override {
    for (std::size_t i = 0; i < forces.size(); ++i) {
      forces[i].force += forces_[i].force;
      forces[i].torque += forces_[i].torque;
    }
  }

 private:
  const std::vector<dynamics::BodyForce>& forces_;
};

}  // namespace layfigure::testing
