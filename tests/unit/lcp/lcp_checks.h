#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "layfigure/dynamics/lcp.h"

namespace layfigure::testing {

/// One problem v = A lambda + b with its rows.
struct LcpSet {
  Eigen::MatrixXd delassus;
  Eigen::VectorXd bias;
  std::vector<dynamics::LcpRow> rows;
  [[nodiscard]] int size() const { return static_cast<int>(rows.size()); }
};

/// Appends the three rows of a contact.
void add_contact(double mu, std::vector<dynamics::LcpRow>& rows);

struct LcpAnswer {
  dynamics::LcpReport report;
  Eigen::VectorXd impulses;    ///< lambda
  Eigen::VectorXd velocities;  ///< v
};

/// Solves from `start` (empty: from zero) with a workspace of its own.
[[nodiscard]] LcpAnswer solve(const LcpSet& set, const Eigen::VectorXd& start = {});

/// The largest violation of the rows' laws as they are written down, without projections or offsets: bounds, the
/// smaller of a distance from a bound and the velocity that does not allow it, the cone, and |v_t| lambda_t + mu
/// lambda_n v_t. Velocities are relative to max |b|, impulses to max |lambda|.
[[nodiscard]] double violation(const LcpSet& set, const Eigen::VectorXd& impulses);

/// Whether lambda is within the bounds and cones, to rounding.
[[nodiscard]] bool is_admissible(const LcpSet& set, const Eigen::VectorXd& impulses);

/// What random_set() draws: `rank` dimensions move the rows (below the number of rows: redundant).
struct RandomLcp {
  int blocks{4};              ///< of three rows each
  int rank{12};               ///< of A
  double contact_share{0.5};  ///< of the blocks; the others are an equality, a unilateral row and a box
  double largest_friction{1.0};
  bool consistent{true};  ///< b is a velocity of the bodies, so that a solution exists; else b is anything
};
[[nodiscard]] LcpSet random_set(const RandomLcp& kind, std::mt19937& random);

}  // namespace layfigure::testing
