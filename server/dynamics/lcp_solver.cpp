#include "lcp_solver.h"

#include <algorithm>
#include <cmath>

namespace layfigure::dynamics::lcp {
namespace {

// Iterations of one convex problem, several times what random sets of 60 rows took.
constexpr int kProximalIterations = 60;
// Where a convex problem counts as solved: e |lambda - y|, a velocity relative to m. Steps on the law itself do the
// rest.
constexpr double kProximalTolerance = 1e-11;
// A step is taken where the slope along it has fallen to this share, in at most so many trials.
constexpr double kSlopeShare = 0.5;
constexpr int kLineTrials = 40;

// e of a round on the law, per residual of its center: an impulse moves by about residual / e, here by a hundredth of
// the largest, along directions that only friction decides. Above the largest e a round hardly moves.
constexpr double kPullPerResidual = 100.0;
constexpr double kLargestPull = 1e-3;
// A round ends at this share of its center's residual; most need 1 to 3 steps.
constexpr double kRoundShare = 0.3;
constexpr int kRoundIterations = 8;
// Below this an answer is about as exact as rounding lets it be.
constexpr double kPolished = 1e-12;
// By how much e rises after a round that was not solved, and beyond what they are given up.
constexpr double kPullRetreat = 10.0;
constexpr double kStrongestPull = 1.0;
// Of a contact's impulse, relative to m: those of lightly loaded fingers beside a loaded palm.
constexpr double kLeastLoad = 1e-4;
// The answers' size is about 1.
constexpr double kStrayed = 1e3;
// A Newton step on the whole law is shortened until the residual falls; if it does not, the best of these is taken, for
// a set may have to change through worse ones.
constexpr double kStepLengths[] = {1.0, 0.5, 0.25, 0.1, 0.03};
// Steps that leave more of the residual than this do not yet, or no longer, converge.
constexpr double kGoodStep = 0.5;
// What a sweep takes for the stiffness of a contact's block, a share of its trace: above half of its largest eigenvalue
// in any case, which a projected gradient step needs to contract, and mostly near it.
constexpr double kBlockStiffness = 0.6;
constexpr int kBlockSteps = 3;
// Rows below this, of a unit diagonal, move by rounding only.
constexpr double kLeastStiffness = 1e-12;

/// The more a stack carries at its foot, the softer it is.
double largest_pull(const Vector& impulses) {
  double largest = 1.0;
  for (const double impulse : impulses) largest = std::max(largest, std::abs(impulse));
  return kLargestPull / largest;
}

}  // namespace

void Solver::reserve(int rows) {
  lcp::reserve(problem, rows);
  step.reserve(rows);
  for (Vector* vector : {&lambda, &y, &v, &offset, &center, &target, &rate, &pull, &base, &best}) vector->reserve(rows);
}

void Solver::start() {
  for (Vector* vector : {&y, &v, &offset, &center, &target, &rate, &pull, &base}) vector->resize(problem.size);
  project(problem, lambda);
  velocities(problem, lambda, v);
  best = lambda;
  best_residual = natural_residual(problem, lambda, v);
  iterations = 0;
}

bool Solver::rate_answer() {
  velocities(problem, lambda, v);
  for (double entry : lambda) {
    if (!(std::abs(entry) <= kLargestSolution)) return false;
  }
  const Residual residual = natural_residual(problem, lambda, v);
  if (residual.value < best_residual.value) {
    best = lambda;
    best_residual = residual;
  }
  return residual.value <= kLcpTolerance;
}

double Solver::residual_here() {
  velocities(problem, y, v);
  return natural_residual(problem, y, v).value;
}

double Solver::residual_of_step(double length) {
  for (int i = 0; i < problem.size; ++i) y[i] = base[i] + length * step.change()[i];
  return residual_here();
}

double Solver::take_step(double residual) {
  base = y;
  double best_length = 1.0;
  double least = LcpRow::kInfinity;
  for (const double length : kStepLengths) {
    const double now = residual_of_step(length);
    if (now < residual) return now;
    if (now < least) {
      least = now;
      best_length = length;
    }
  }
  return residual_of_step(best_length);
}

bool Solver::accept() {
  base = lambda;
  lambda = y;
  project(problem, lambda);
  if (rate_answer()) return true;
  velocities(problem, y, v);
  lambda = base;
  return false;
}

bool Solver::solve_coulomb(int limit, bool while_halved) {
  y = lambda;
  std::fill(pull.begin(), pull.end(), 0.0);
  double residual = residual_here();
  for (int k = 0; k < limit; ++k) {
    if (residual <= kLcpTolerance && accept()) return true;
    coulomb_step(problem, pull, y, v, step);
    ++iterations;
    const double before = residual;
    residual = take_step(residual);
    if (while_halved && !(residual <= kGoodStep * before)) break;
  }
  return residual <= kLcpTolerance && accept();
}

void Solver::keep_iterate() {
  base = lambda;
  lambda = y;
  project(problem, lambda);
  const double before = best_residual.value;
  (void)rate_answer();
  if (!(best_residual.value < before)) lambda = base;
}

/// A pulled step falls short of the answer by its pull: one without it is mostly exact.
bool Solver::polish_and_accept(double residual) {
  if (residual > kPolished) {
    base = y;
    std::fill(pull.begin(), pull.end(), 0.0);
    coulomb_step(problem, pull, y, v, step);
    ++iterations;
    if (!(residual_of_step(1.0) < residual)) (void)residual_of_step(0.0);
  }
  return accept();
}

bool Solver::end_at_iterate(double residual) {
  if (residual <= kLcpTolerance && polish_and_accept(residual)) return true;
  lambda = y;
  project(problem, lambda);
  if (rate_answer()) return true;
  // Far from any answer, or not finite: not a place to go on from.
  if (!(natural_residual(problem, lambda, v).value <= kStrayed)) lambda = best;
  return false;
}

/// Of equation (2), about `center`; v then includes the pull.
double Solver::pulled_residual(double epsilon) {
  velocities(problem, y, v);
  for (int i = 0; i < problem.size; ++i) v[i] += epsilon * (y[i] - center[i]);
  return natural_residual(problem, y, v).value;
}

/// Whole Newton steps on (2) from its center, until its residual is the wanted one. They may have to pass through
/// worse iterates, in which a search along a step would stay.
bool Solver::solve_round(double epsilon, double wanted) {
  std::fill(pull.begin(), pull.end(), epsilon);
  for (int k = 0; k < kRoundIterations; ++k) {
    coulomb_step(problem, pull, y, v, step);
    ++iterations;
    for (int i = 0; i < problem.size; ++i) y[i] += step.change()[i];
    if (pulled_residual(epsilon) <= wanted) return true;
  }
  return false;
}

bool Solver::solve_by_pulling(int limit) {
  y = lambda;
  double residual = residual_here();
  double epsilon = std::min(kPullPerResidual * residual, largest_pull(y));
  for (const int end = iterations + limit; iterations < end && epsilon <= kStrongestPull;) {
    if (residual <= kLcpTolerance && polish_and_accept(residual)) return true;
    center = y;
    if (solve_round(epsilon, std::max(kRoundShare * residual, kRoundShare * kLcpTolerance))) {
      residual = residual_here();
      epsilon = std::min({epsilon, kPullPerResidual * residual, largest_pull(y)});
    } else {
      y = center;
      residual = residual_here();
      epsilon *= kPullRetreat;
    }
  }
  return end_at_iterate(residual);
}

/// A pull that lets each contact's impulse change by about itself.
void Solver::pull_by_load(double residual) {
  for (int i = 0; i < problem.size; i += rows_of(problem.rows[i])) {
    pull[i] = std::min(residual / (std::abs(y[i]) + kLeastLoad), kLargestPull);
  }
}

bool Solver::solve_by_creeping(int limit) {
  y = lambda;
  double residual = residual_here();
  for (int k = 0; k < limit; ++k) {
    if (residual <= kLcpTolerance && polish_and_accept(residual)) return true;
    pull_by_load(residual);
    coulomb_step(problem, pull, y, v, step);
    ++iterations;
    for (int i = 0; i < problem.size; ++i) y[i] += step.change()[i];
    residual = residual_here();
  }
  return end_at_iterate(residual);
}

double Solver::proximal_gap(double epsilon) {
  double gap = 0.0;
  for (int i = 0; i < problem.size; ++i) target[i] = center[i] - (v[i] + offset[i]) / epsilon;
  project(problem, target);
  for (int i = 0; i < problem.size; ++i) gap = std::max(gap, epsilon * std::abs(target[i] - y[i]));
  return gap;
}

double Solver::slope_at(double epsilon, double length) {
  for (int i = 0; i < problem.size; ++i) target[i] = center[i] - (v[i] + length * rate[i] + offset[i]) / epsilon;
  project(problem, target);
  double slope = 0.0;
  for (int i = 0; i < problem.size; ++i) slope += rate[i] * (y[i] + length * step.change()[i] - target[i]);
  return slope;
}

double Solver::search_line(double epsilon) {
  const double start = slope_at(epsilon, 0.0);
  if (!(start < 0.0)) return 1.0;  // along the null space of A, where the function is level
  const double enough = -kSlopeShare * start;
  if (slope_at(epsilon, 1.0) <= enough) return 1.0;
  // The slope grows with the length, as the function is convex: its root is bracketed.
  double low = 0.0;
  double high = 1.0;
  for (int k = 0; k < kLineTrials; ++k) {
    const double middle = 0.5 * (low + high);
    const double slope = slope_at(epsilon, middle);
    if (std::abs(slope) <= enough) return middle;
    (slope < 0.0 ? low : high) = middle;
  }
  return low;
}

void Solver::advance(double length) {
  for (int i = 0; i < problem.size; ++i) y[i] += length * step.change()[i];
  velocities(problem, y, v);
}

void Solver::solve_proximal(double epsilon) {
  y = center;
  velocities(problem, y, v);
  for (int k = 0; k < kProximalIterations && proximal_gap(epsilon) > kProximalTolerance; ++k) {
    proximal_step(problem, {.epsilon = epsilon, .center = center, .offset = offset}, y, v, step);
    ++iterations;
    std::fill(rate.begin(), rate.end(), 0.0);
    add_product(problem, step.change(), rate);
    advance(search_line(epsilon));
  }
  lambda = target;
}

void Solver::relax(int row, int count) {
  double stiffness = 0.0;
  for (int k = row; k < row + count; ++k) stiffness += problem.column(k)[k];
  if (count > 1) stiffness *= kBlockStiffness;
  if (stiffness < kLeastStiffness) return;
  double next[3];
  for (int k = 0; k < count; ++k) next[k] = lambda[row + k] - v[row + k] / stiffness;
  apply_law(problem.rows[row], next);
  for (int k = 0; k < count; ++k) {
    const double change = next[k] - lambda[row + k];
    if (change == 0.0) continue;
    lambda[row + k] = next[k];
    const double* column = problem.column(row + k);
    const auto [first, end] = problem.extents[row + k];
    for (int i = first; i < end; ++i) v[i] += change * column[i];
  }
}

void Solver::sweep(int count) {
  velocities(problem, lambda, v);
  for (int k = 0; k < count; ++k) {
    for (int i = 0; i < problem.size; i += rows_of(problem.rows[i])) {
      const int rows = rows_of(problem.rows[i]);
      for (int repeat = 0; repeat < (rows > 1 ? kBlockSteps : 1); ++repeat) relax(i, rows);
    }
  }
}

}  // namespace layfigure::dynamics::lcp
