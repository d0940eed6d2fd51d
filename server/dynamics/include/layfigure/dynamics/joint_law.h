#pragma once

#include "layfigure/dynamics/model.h"
#include "layfigure/math/spatial.h"

/// The elasto-plastic law of a ball joint, implicit in the angular velocity, generic in the scalar.
///
/// In the axes of the joint's section (twist, bend, bend) the stiffness K_f and the damping D_f are diagonal. The
/// strain q splits into an elastic part q_f of a Kelvin-Voigt element and a flow q_d in series with it:
///     t = K_f q_f + D_f w_f,   w = w_f + w_d                                              (Matsunaga, Eq. 1; t =
///     -lambda)
/// Torques are measured by the elliptic norm n(t) = sqrt(sum (t_i / e_i)^2), e the yield ratios, and flow is normal to
/// the ellipsoid: w_d = mu t / e^2 (per axis), which makes it the gradient of a convex function of t. The speed of flow
/// is r = mu n, the accumulated flow is its integral, and the yield torque y grows with it: y = (t_y + H flow) scale.
///     overstress law :  n = y + D_d r                 where n > y, else r = 0
///     paper law      :  r = n / D_d where n > y;  any r from 0 to n / D_d where n = y;  else r = 0
/// One implicit Euler step of length h, with a = K_f h + D_f and the trial torque s = K_f q_f[n] + a w:
///     t_i = s_i / (1 + a_i mu / e_i^2),   y / n(mu) - 1 + d mu = 0,   q_f[n+1] = q_f[n] + h (w - (s - t) / a)
/// with d = D_d + H h (overstress) or d = H h and mu at most 1 / D_d (paper). The left side of the scalar equation is
/// an increasing, concave function of mu, so Newton's method from below converges without overshooting; for an
/// isotropic joint its first step is exact. dt/ds follows by differentiating both; dt/dw = dt/ds a is symmetric and
/// positive semidefinite, so the whole step has exactly one solution.
///
/// Deviations from the paper: the switch at yield is this monotone law instead of a test of the last step's torque;
/// written with mu instead of the paper's C and D (Eq. 2), it holds for D_d = 0 (perfect plasticity) as well.
namespace layfigure::dynamics {

/// The parameters of the law over one step, section axes.
template <class T>
struct StepLaw {
  math::Vec3<T> gain;           ///< a
  math::Vec3<T> inverse_shape;  ///< 1 / e^2; 0 on an axis that never yields
  T flow_damping;               ///< D_d
  T hardening;                  ///< H h scale
  T yield;                      ///< y at the beginning of the step; infinity: elastic
};

/// The torque at a trial torque s, and its slope:
///     t = share s,   dt/ds = diag(share) - curvature (a u) u^T
template <class T>
struct Return {
  math::Vec3<T> share;
  math::Vec3<T> u;
  T curvature;
  T flowing;  ///< 1 where n(s) > y, else 0
};

// Newton's method doubles its digits near the root; from the isotropic estimate 6 iterations reach rounding for
// stiffness ratios of 1e6 between the axes.
constexpr int kReturnIterations = 8;
// Stands for an infinite mu: a joint without yield torque, flow damping or hardening holds no torque at all.
constexpr double kLooseFlow = 1e250;

template <class T>
inline math::Vec3<T> times(const math::Vec3<T>& a, const math::Vec3<T>& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}

/// n(s)^2
template <class T>
inline T squared_norm(const StepLaw<T>& law, const math::Vec3<T>& s) {
  return dot(times(s, s), law.inverse_shape);
}

template <class T>
inline math::Vec3<T> shares(const math::Vec3<T>& alpha, const T& mu) {
  return {T(1.0) / (T(1.0) + alpha.x * mu), T(1.0) / (T(1.0) + alpha.y * mu), T(1.0) / (T(1.0) + alpha.z * mu)};
}

/// Root mu of y / n(mu) - 1 + d mu, for lanes with n(s) > y; alpha = a / e^2, weight = (s / e)^2.
template <class T>
inline T flow_multiplier(const math::Vec3<T>& alpha, const math::Vec3<T>& weight, const T& yield, const T& d,
                         const T& norm) {
  const T most = math::maximum(alpha.x, math::maximum(alpha.y, alpha.z));
  const T bound = yield * most + d * norm;
  const auto solvable = bound > T(0.0);
  T mu = math::select(solvable, (norm - yield) / math::select(solvable, bound, T(1.0)), T(kLooseFlow));
  for (int k = 0; k < kReturnIterations; ++k) {
    const math::Vec3<T> r = shares(alpha, mu);
    const math::Vec3<T> wr2 = times(weight, times(r, r));
    const T n2 = wr2.x + wr2.y + wr2.z;
    const T n = math::square_root(n2);
    const T value = yield - n + d * mu * n;                          // n times the equation
    const T slope = yield * dot(wr2, times(alpha, r)) / n2 + d * n;  // n times its derivative
    const auto go = solvable && slope > T(0.0);
    const T change = math::select(go, -value / math::select(go, slope, T(1.0)), T(0.0));
    mu = mu + math::maximum(change, T(0.0));
  }
  return mu;
}

template <class T>
inline Return<T> elastic_return() {
  return {{T(1.0), T(1.0), T(1.0)}, {}, T(0.0), T(0.0)};
}

template <class T>
inline Return<T> radial_return(FlowLaw kind, const StepLaw<T>& law, const math::Vec3<T>& s) {
  const T n0_squared = squared_norm(law, s);
  const auto yields = n0_squared > law.yield * law.yield;
  if (!math::any(yields)) return elastic_return<T>();
  const T one(1.0);
  const T zero(0.0);
  // Lanes below yield compute nonsense that is finite and thrown away.
  const T yield = math::select(yields, law.yield, one);
  const math::Vec3<T> alpha = times(law.gain, law.inverse_shape);
  const math::Vec3<T> weight = times(times(s, s), law.inverse_shape);
  const T norm = math::square_root(math::select(yields, n0_squared, one + one));
  const bool paper = kind == FlowLaw::kPaper;
  const T d = paper ? law.hardening : law.hardening + law.flow_damping;
  T mu = flow_multiplier(alpha, weight, yield, d, norm);
  auto free = mu < zero;  // flows at the rate of the damper alone
  if (paper) {
    const auto damped = law.flow_damping > zero;
    const T cap = math::select(damped, one / math::select(damped, law.flow_damping, one), T(kLooseFlow));
    free = mu > cap;
    mu = math::select(free, cap, mu);
  }
  const math::Vec3<T> r = shares(alpha, mu);
  const math::Vec3<T> t = times(s, r);
  const math::Vec3<T> u = times(times(t, r), law.inverse_shape);
  const T n2 = dot(times(t, t), law.inverse_shape);
  const T q = dot(times(u, t), times(law.gain, law.inverse_shape));
  const T bend = d * n2 * math::square_root(n2) + q * yield;
  const auto curved = bend > zero && !free;
  const T curvature = math::select(curved, yield / math::select(curved, bend, one), zero);
  const math::Vec3<T> whole{one, one, one};
  return {math::select(yields, r, whole), math::select(yields, u, math::Vec3<T>{}),
          math::select(yields, curvature, zero), math::select(yields, one, zero)};
}

}  // namespace layfigure::dynamics
