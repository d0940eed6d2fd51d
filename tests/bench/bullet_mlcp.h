#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "contact_problem.h"

/// Bullet's own solvers of complementarity problems, on ours. In single precision, as Debian builds it. They take boxes
/// only (friction as a pyramid whose size lags or is iterated), so that they solve our problem where there is no
/// friction.
namespace layfigure::bench {

enum class BulletMlcp { kDantzig, kLemke, kGaussSeidel, kLongGaussSeidel };
inline constexpr BulletMlcp kBulletMlcps[] = {BulletMlcp::kDantzig, BulletMlcp::kLemke, BulletMlcp::kGaussSeidel,
                                              BulletMlcp::kLongGaussSeidel};

[[nodiscard]] std::string name_of(BulletMlcp solver);

struct BulletAnswer {
  Eigen::VectorXd impulses;
  bool claimed{false};      ///< the solver says that it succeeded
  double cpu_seconds{0.0};  ///< median, of the solution alone
};
/// `problem` has no friction. From zero.
[[nodiscard]] BulletAnswer solve_by_bullet(BulletMlcp solver, const ContactProblem& problem);

}  // namespace layfigure::bench
