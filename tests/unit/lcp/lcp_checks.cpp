#include "lcp_checks.h"

#include <algorithm>
#include <cmath>

namespace layfigure::testing {

using dynamics::LcpRow;
using dynamics::LcpRowKind;

namespace {

constexpr double kRounding = 1e-12;

double box_violation(double lambda, double v, double lower, double upper) {
  const double outside = std::max({lower - lambda, lambda - upper, 0.0});
  return std::max({outside, std::min(lambda - lower, v), std::min(upper - lambda, -v)});
}

double contact_violation(const Eigen::Vector3d& lambda, const Eigen::Vector3d& v, double mu) {
  const Eigen::Vector2d friction = lambda.tail<2>();
  const Eigen::Vector2d slip = v.tail<2>();
  const double edge = mu * lambda[0];
  return std::max({box_violation(lambda[0], v[0], 0.0, LcpRow::kInfinity), friction.norm() - edge,
                   (slip.norm() * friction + edge * slip).norm()});
}

}  // namespace

void add_contact(double mu, std::vector<LcpRow>& rows) {
  rows.push_back(LcpRow::contact(mu));
  rows.push_back(LcpRow::tangent());
  rows.push_back(LcpRow::tangent());
}

LcpAnswer solve(const LcpSet& set, const Eigen::VectorXd& start) {
  dynamics::LcpWorkspace workspace;
  LcpAnswer answer;
  answer.impulses = start.size() > 0 ? start : Eigen::VectorXd::Zero(set.size());
  answer.report = dynamics::solve_lcp(set.delassus, set.bias, set.rows, answer.impulses, workspace);
  answer.velocities = set.delassus * answer.impulses + set.bias;
  return answer;
}

double violation(const LcpSet& set, const Eigen::VectorXd& impulses) {
  const Eigen::VectorXd velocities = set.delassus * impulses + set.bias;
  const double speed = std::max(set.bias.lpNorm<Eigen::Infinity>(), 1e-300);
  const double size = std::max(impulses.lpNorm<Eigen::Infinity>(), 1e-300);
  double worst = 0.0;
  for (int i = 0; i < set.size(); ++i) {
    const LcpRow& row = set.rows[i];
    if (row.kind == LcpRowKind::kBox) {
      worst =
          std::max(worst, box_violation(impulses[i] / size, velocities[i] / speed, row.lower / size, row.upper / size));
    } else if (row.kind == LcpRowKind::kContact) {
      worst = std::max(
          worst, contact_violation(impulses.segment<3>(i) / size, velocities.segment<3>(i) / speed, row.friction));
    }
  }
  return worst;
}

bool is_admissible(const LcpSet& set, const Eigen::VectorXd& impulses) {
  if (!impulses.allFinite()) return false;
  for (int i = 0; i < set.size(); ++i) {
    const LcpRow& row = set.rows[i];
    const double slack = kRounding * std::abs(impulses[i]);
    if (row.kind == LcpRowKind::kBox && (impulses[i] < row.lower - slack || impulses[i] > row.upper + slack))
      return false;
    if (row.kind == LcpRowKind::kContact &&
        impulses.segment<2>(i + 1).norm() > row.friction * impulses[i] * (1 + kRounding)) {
      return false;
    }
  }
  return true;
}

LcpSet random_set(const RandomLcp& kind, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto draw = [&] { return normal(random); };
  const int n = 3 * kind.blocks;
  const Eigen::MatrixXd jacobian = Eigen::MatrixXd::NullaryExpr(n, kind.rank, draw);
  LcpSet set;
  set.delassus = jacobian * jacobian.transpose();
  if (kind.consistent) {
    set.bias = jacobian * Eigen::VectorXd::NullaryExpr(kind.rank, draw);
  } else {
    set.bias = Eigen::VectorXd::NullaryExpr(n, draw);
  }
  for (int i = 0; i < kind.blocks; ++i) {
    if (uniform(random) < kind.contact_share) {
      const double mu = kind.largest_friction * uniform(random);
      add_contact(mu, set.rows);
    } else {
      const double upper = uniform(random);
      set.rows.push_back(LcpRow::equality());
      set.rows.push_back(LcpRow::unilateral());
      set.rows.push_back(LcpRow::box(-uniform(random), upper));
    }
  }
  return set;
}

}  // namespace layfigure::testing
