#include "lcp_newton.h"

#include <algorithm>

namespace layfigure::dynamics::lcp {
namespace {

// d: added to a unit diagonal so that redundant rows share their load instead of dividing by zero. Well above the
// rounding of a factorisation (1e-16 times the rows), and it leaves a residual below kLcpTolerance.
constexpr double kRegularization = 1e-11;
// Least rho: keeps E finite at the cone's apex, and without friction.
constexpr double kLeastShare = 1e-14;

/// Where z_t points, and q^T y.
struct Slide {
  double t[2];
  double around;
};

Slide slide_of(const double* z, double length_of_z, const double* y) {
  const double t0 = z[1] / length_of_z;
  const double t1 = z[2] / length_of_z;
  return {.t = {t0, t1}, .around = t0 * y[2] - t1 * y[1]};
}

Direction around_cone(int row, const Slide& slide, double compliance, double rhs) {
  return {.row = row,
          .count = 3,
          .u = {0.0, -slide.t[1], slide.t[0]},
          .w = {0.0, -slide.t[1], slide.t[0]},
          .compliance = compliance,
          .rhs = rhs};
}

void release(int row, const double* y, ReducedSystem& step) {
  for (int k = 0; k < 3; ++k) step.jump(row + k, -y[k]);
}

void coulomb_contact(double mu, double compliance, int row, const double* y, const double* v, ReducedSystem& step) {
  const double z[3] = {y[0] - v[0], y[1] - v[1], y[2] - v[2]};
  const double trial = length(z + 1);
  if (!(z[0] > 0.0)) return release(row, y, step);
  if (trial <= mu * z[0]) {
    for (int k = 0; k < 3; ++k) step.add_free_row(row + k, compliance, -v[k]);
    return;
  }
  const Slide slide = slide_of(z, trial, y);
  step.add({.row = row,
            .count = 3,
            .u = {1.0, mu * slide.t[0], mu * slide.t[1]},
            .w = {1.0, 0.0, 0.0},
            .compliance = compliance,
            .rhs = -v[0]});
  const double inverse_share = 1.0 / std::max(mu * z[0] / trial, kLeastShare);
  step.add(around_cone(row, slide, inverse_share - 1.0 + compliance, -inverse_share * slide.around));
  const double missing = mu * y[0] - slide.t[0] * y[1] - slide.t[1] * y[2];
  step.jump(row + 1, missing * slide.t[0]);
  step.jump(row + 2, missing * slide.t[1]);
}

void proximal_slide(double mu, double epsilon, int row, const double* z, const double* y, const double* gradient,
                    ReducedSystem& step) {
  const double trial = length(z + 1);
  const Slide slide = slide_of(z, trial, y);
  const double widening = 1.0 + mu * mu;
  const double p[3] = {1.0, mu * slide.t[0], mu * slide.t[1]};
  step.add({.row = row,
            .count = 3,
            .u = {p[0], p[1], p[2]},
            .w = {p[0], p[1], p[2]},
            .compliance = epsilon * widening,
            .rhs = p[0] * gradient[0] + p[1] * gradient[1] + p[2] * gradient[2]});
  const double normal = (z[0] + mu * trial) / widening;
  const double curvature = epsilon / std::max(mu * normal / trial, kLeastShare);
  step.add(around_cone(row, slide, curvature, -curvature * slide.around));
  const double across = (slide.t[0] * y[1] + slide.t[1] * y[2] - mu * y[0]) / widening;
  step.jump(row, mu * across);
  step.jump(row + 1, -slide.t[0] * across);
  step.jump(row + 2, -slide.t[1] * across);
}

void proximal_contact(double mu, const Proximal& at, int row, const double* y, const double* v, ReducedSystem& step) {
  double z[3];
  double gradient[3];
  for (int k = 0; k < 3; ++k) {
    const double velocity = v[k] + at.offset[row + k];
    z[k] = at.center[row + k] - velocity / at.epsilon;
    gradient[k] = at.epsilon * (at.center[row + k] - y[k]) - velocity;
  }
  switch (cone_case(mu, z[0], length(z + 1))) {
    case ConeCase::kPolar:
      return release(row, y, step);
    case ConeCase::kInside:
      for (int k = 0; k < 3; ++k) step.add_free_row(row + k, at.epsilon, gradient[k]);
      return;
    case ConeCase::kOutside:
      return proximal_slide(mu, at.epsilon, row, z, y, gradient, step);
  }
}

}  // namespace

void coulomb_step(const Problem& problem, const Vector& epsilon, const Vector& y, const Vector& v,
                  ReducedSystem& step) {
  step.clear(problem.size);
  for (int i = 0; i < problem.size; i += rows_of(problem.rows[i])) {
    const LcpRow& row = problem.rows[i];
    const double compliance = epsilon[i] + kRegularization;
    const double z = y[i] - v[i];
    if (row.kind == LcpRowKind::kContact) {
      coulomb_contact(row.friction, compliance, i, &y[i], &v[i], step);
    } else if (z > row.lower && z < row.upper) {
      step.add_free_row(i, compliance, -v[i]);
    } else {
      step.jump(i, std::clamp(z, row.lower, row.upper) - y[i]);
    }
  }
  step.solve(problem);
}

void proximal_step(const Problem& problem, const Proximal& at, const Vector& y, const Vector& v, ReducedSystem& step) {
  step.clear(problem.size);
  for (int i = 0; i < problem.size; i += rows_of(problem.rows[i])) {
    const LcpRow& row = problem.rows[i];
    const double z = at.center[i] - v[i] / at.epsilon;  // s is zero on rows that are no contact's
    if (row.kind == LcpRowKind::kContact) {
      proximal_contact(row.friction, at, i, &y[i], &v[i], step);
    } else if (z > row.lower && z < row.upper) {
      step.add_free_row(i, at.epsilon, at.epsilon * (at.center[i] - y[i]) - v[i]);
    } else {
      step.jump(i, std::clamp(z, row.lower, row.upper) - y[i]);
    }
  }
  step.solve(problem);
}

}  // namespace layfigure::dynamics::lcp
