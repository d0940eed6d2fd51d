#include "lcp_reference.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace layfigure::testing {

using dynamics::LcpRow;
using dynamics::LcpRowKind;

namespace {

constexpr int kSweeps = 200000;
constexpr double kConverged = 1e-13;

/// The impulses of the active set `code` in base 3; false if a row at a bound has none.
bool try_active_set(const LcpSet& set, int code, Eigen::VectorXd& impulses) {
  Eigen::MatrixXd system = set.delassus;
  Eigen::VectorXd rhs = -set.bias;
  for (int i = 0; i < set.size(); ++i, code /= 3) {
    if (code % 3 == 1) continue;
    const double bound = code % 3 == 0 ? set.rows[i].lower : set.rows[i].upper;
    if (!std::isfinite(bound)) return false;
    system.row(i).setZero();
    system(i, i) = 1.0;
    rhs[i] = bound;
  }
  impulses = system.partialPivLu().solve(rhs);
  return true;
}

double relax_box(const LcpSet& set, int i, Eigen::VectorXd& impulses) {
  const double v = set.delassus.row(i).dot(impulses) + set.bias[i];
  const double next = std::clamp(impulses[i] - v / set.delassus(i, i), set.rows[i].lower, set.rows[i].upper);
  return std::abs(std::exchange(impulses[i], next) - next);
}

double relax_contact(const LcpSet& set, int i, Eigen::VectorXd& impulses) {
  const double normal_speed = set.delassus.row(i).dot(impulses) + set.bias[i];
  const double normal = std::max(0.0, impulses[i] - normal_speed / set.delassus(i, i));
  const double normal_change = std::abs(std::exchange(impulses[i], normal) - normal);
  const Eigen::Vector2d slip = set.delassus.middleRows(i + 1, 2) * impulses + set.bias.segment<2>(i + 1);
  Eigen::Vector2d friction = impulses.segment<2>(i + 1) - slip / set.delassus.block<2, 2>(i + 1, i + 1).trace();
  const double radius = set.rows[i].friction * normal;
  if (friction.norm() > radius) friction *= radius / friction.norm();
  const double change = (friction - impulses.segment<2>(i + 1)).norm();
  impulses.segment<2>(i + 1) = friction;
  return std::max(change, normal_change);
}

}  // namespace

Eigen::VectorXd solve_by_enumeration(const LcpSet& set) {
  const int codes = static_cast<int>(std::lround(std::pow(3.0, set.size())));
  Eigen::VectorXd impulses;
  for (int code = 0; code < codes; ++code) {
    if (try_active_set(set, code, impulses) && violation(set, impulses) < 1e-10) return impulses;
  }
  throw std::runtime_error("no active set satisfies the rows");
}

ReferenceAnswer solve_by_gauss_seidel(const LcpSet& set) {
  ReferenceAnswer answer{.impulses = Eigen::VectorXd::Zero(set.size())};
  for (int sweep = 0; sweep < kSweeps && !answer.converged; ++sweep) {
    double change = 0.0;
    for (int i = 0; i < set.size(); ++i) {
      if (set.rows[i].kind == LcpRowKind::kBox) change = std::max(change, relax_box(set, i, answer.impulses));
      if (set.rows[i].kind == LcpRowKind::kContact) change = std::max(change, relax_contact(set, i, answer.impulses));
    }
    answer.converged = change < kConverged;
  }
  return answer;
}

}  // namespace layfigure::testing
