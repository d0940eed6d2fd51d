#pragma once

#include <Eigen/Core>
#include <vector>

#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"

/// The base step's equations as dense matrices: what the O(n) recursion is checked against, and what makes the Delassus
/// matrix of contacts where it is wanted by itself.
namespace layfigure::testing {

/// With J the bodies' world velocities [angular; of the com] for unit joint velocities, M their inertias and G the
/// joints' implicit stiffness and damping, a step of length h solves
///     (J^T M J + G) w = J^T (P + h F) - h K_f strain
/// Columns: three for each body, its joint's velocity in the child's axes; then, for a free root, three for the
/// velocity of its origin.
struct DenseStep {
  Eigen::MatrixXd jacobian;  ///< J, 6 rows for each body
  Eigen::MatrixXd matrix;    ///< J^T M J + G, positive definite
  Eigen::VectorXd right;     ///< of the equation
  std::vector<dynamics::BodyPose> poses;
};

/// The step of elastic joints, isotropic where they are strained, without loads, limits and contacts; the root a ball
/// joint or free. O(n^3).
[[nodiscard]] DenseStep dense_step(const dynamics::Model& model, const dynamics::State& state, double h);

}  // namespace layfigure::testing
