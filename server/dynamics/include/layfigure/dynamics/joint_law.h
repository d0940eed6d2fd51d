#pragma once

#include "layfigure/dynamics/model.h"
#include "layfigure/math/spatial.h"

/// The elasto-plastic law of a ball joint, implicit in the angular velocity, generic in the scalar.
///
/// The strain q splits into an elastic part q_f of a Kelvin-Voigt element and a flow q_d in series with it:
///     t = K_f q_f + D_f w_f,   w = w_f + w_d,   w_d a maximal monotone function of t (FlowLaw)      (Matsunaga, Eq. 1)
/// One implicit Euler step of length h, with a = K_f h + D_f and the trial torque s = K_f q_f[n] + a w:
///     |s| <= t_y       : t = s
///     paper law        : t = s/|s| max(t_y, |s| D_d / (D_d + a))
///     overstress law   : t = s/|s| (|s| D_d + a t_y) / (D_d + a)
///     flow             : w_d = (s - t) / a
/// t is the radial return of s, a monotone function of w, so the whole step has exactly one solution. Written with
/// D_d / (D_d + a) instead of the paper's C and D of Eq. 2, it holds for D_d = 0 (perfect plasticity) as well.
/// All vectors in the child's axes.
namespace layfigure::dynamics {

/// t and dt/ds of one joint at a trial torque s along n = s/|s|: t = tangential s, dt/ds = radial n n^T + tangential
/// (1 - n n^T).
template <class T>
struct Return {
  T radial;
  T tangential;
};

template <class T>
inline Return<T> radial_return(FlowLaw law, const T& a, const T& flow_damping, const T& yield, const T& trial_norm) {
  const auto yields = trial_norm > yield;
  const T one = T(1.0);
  const T sum = flow_damping + a;
  const T share = flow_damping / math::select(sum > 0.0, sum, one);
  const T norm = math::select(yields, trial_norm, one);
  T radial, torque;
  if (law == FlowLaw::kPaper) {
    const T flowing = norm * share;
    radial = math::select(flowing > yield, share, T(0.0));
    torque = math::select(flowing > yield, flowing, yield);
  } else {
    radial = share;
    torque = norm * share + yield * (1.0 - share);
  }
  return {math::select(yields, radial, one), math::select(yields, torque / norm, one)};
}

}  // namespace layfigure::dynamics
