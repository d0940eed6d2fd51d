#include "lcp_solver.h"

#include <algorithm>

namespace layfigure::dynamics::lcp {
namespace {

// Iterations of one convex problem, several times what random sets of 60 rows took.
constexpr int kProximalIterations = 60;
// Where a convex problem counts as solved: e |lambda - y|, a velocity relative to m. The fast path does the rest.
constexpr double kProximalTolerance = 1e-11;
// A step is taken where the slope along it has fallen to this share, in at most so many trials.
constexpr double kSlopeShare = 0.5;
constexpr int kLineTrials = 40;

// A Newton step on the whole law is shortened until the residual falls; if it does not, the best of these is taken, for
// a set may have to change through worse ones.
constexpr double kStepLengths[] = {1.0, 0.5, 0.25, 0.1, 0.03};
// What a sweep takes for the stiffness of a contact's block, a share of its trace: above half of its largest eigenvalue
// in any case, which a projected gradient step needs to contract, and mostly near it.
constexpr double kBlockStiffness = 0.6;
constexpr int kBlockSteps = 3;
// Rows below this, of a unit diagonal, move by rounding only.
constexpr double kLeastStiffness = 1e-12;

}  // namespace

void Solver::reserve(int rows) {
  lcp::reserve(problem, rows);
  step.reserve(rows);
  for (Vector* vector : {&lambda, &y, &v, &offset, &center, &target, &rate, &base, &best}) vector->reserve(rows);
}

void Solver::start() {
  for (Vector* vector : {&y, &v, &offset, &center, &target, &rate, &base}) vector->resize(problem.size);
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

double Solver::residual_at(double epsilon) {
  velocities(problem, y, v);
  if (epsilon > 0.0) {
    for (int i = 0; i < problem.size; ++i) v[i] += epsilon * (y[i] - center[i]);
  }
  return natural_residual(problem, y, v).value;
}

double Solver::residual_of_step(double epsilon, double length) {
  for (int i = 0; i < problem.size; ++i) y[i] = base[i] + length * step.change()[i];
  return residual_at(epsilon);
}

double Solver::take_step(double epsilon, double residual) {
  base = y;
  double best_length = 1.0;
  double least = LcpRow::kInfinity;
  for (const double length : kStepLengths) {
    const double now = residual_of_step(epsilon, length);
    if (now < residual) return now;
    if (now < least) {
      least = now;
      best_length = length;
    }
  }
  return residual_of_step(epsilon, best_length);
}

bool Solver::accept(double epsilon) {
  base = lambda;
  lambda = y;
  project(problem, lambda);
  // A round's answer is a start of the next one: it need not be exact in K.
  if (epsilon > 0.0 || rate_answer()) return true;
  velocities(problem, y, v);
  lambda = base;
  return false;
}

bool Solver::solve_coulomb(double epsilon, int limit) {
  y = lambda;
  double residual = residual_at(epsilon);
  for (int k = 0; k < limit; ++k) {
    if (residual <= kLcpTolerance && accept(epsilon)) return true;
    coulomb_step(problem, epsilon, y, v, step);
    ++iterations;
    residual = take_step(epsilon, residual);
  }
  return residual <= kLcpTolerance && accept(epsilon);
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
    for (int i = 0; i < problem.size; ++i) v[i] += change * column[i];
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
