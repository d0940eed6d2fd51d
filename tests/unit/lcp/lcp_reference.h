#pragma once

#include "lcp_checks.h"

namespace layfigure::testing {

/// A second, independent solver for small sets without contacts: tries every active set (3^n: at its lower bound,
/// between, at its upper bound) with a dense factorisation until one satisfies all laws. A must be positive definite.
[[nodiscard]] Eigen::VectorXd solve_by_enumeration(const LcpSet& set);

/// A second, independent solver for any size: projected Gauss-Seidel to convergence, with friction by Alart and
/// Curnier's law (a disc whose radius follows the normal impulse) instead of a cone and De Saxce's offset.
/// `converged` tells whether an iteration changed nothing above 1e-13.
struct ReferenceAnswer {
  Eigen::VectorXd impulses;
  bool converged{false};
};
[[nodiscard]] ReferenceAnswer solve_by_gauss_seidel(const LcpSet& set);

}  // namespace layfigure::testing
