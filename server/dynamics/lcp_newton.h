#pragma once

#include "lcp_system.h"

namespace layfigure::dynamics::lcp {

/// Newton steps dy on an equation  y = P(z(y)),  z a combination of y and v = A y + b. P's Jacobian is 1 on free rows,
/// 0 on rows at a bound, and has one direction p along the cone's edge and one, q, around it on a sliding contact. In
/// these directions U the step is a small system,
///     dy = g + U x,   (E + W^T A U) x = r - W^T A g,
/// with g the jump of the components that the law fixes. t is the unit vector of z_t, q = (0, t turned by 90 degrees),
/// p = (1, mu t), d a regularisation (below). Nothing in it is divided by a small e.

/// Step on the whole law, equation (1) of lcp.h, z = y - v:
///                          U   W   E               r
///     free or sticking row 1   1   e + d           -v
///     sliding contact      p   n   e + d           -v_n               n: the normal row
///                          q   q   1/rho - 1 + e + d   -(1/rho) q^T y     rho = mu z_n / |z_t|
/// and on a sliding contact g = (mu y_n - t^T y_t) t. Unsymmetric where W differs from U: where contacts slide. Each
/// contact has the e of its first row. With e > 0 the step is on the law of equation (2), if v includes the pull
/// e (y - c); if it does not, c is y.
void coulomb_step(const Problem& problem, const Vector& epsilon, const Vector& y, const Vector& v, ReducedSystem& step);

/// The convex problem (3) of lcp.h.
struct Proximal {
  double epsilon;        ///< e > 0
  const Vector& center;  ///< lambda[k]
  const Vector& offset;  ///< s
};

/// Step on the optimality of the convex problem, z = c - (v + s) / e:
///                          U   W   E               r
///     free row, apex's     1   1   e               e (c - y) - (v + s)
///     sliding contact      p   p   e (1 + mu^2)    p^T (e (c - y) - (v + s))
///                          q   q   e/rho           -(e/rho) q^T y     rho = mu lambda_n / |z_t|
/// and on a sliding contact g removes y's component across the cone's surface, along (-mu, t).
void proximal_step(const Problem& problem, const Proximal& at, const Vector& y, const Vector& v, ReducedSystem& step);

}  // namespace layfigure::dynamics::lcp
