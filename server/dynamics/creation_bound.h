#pragma once

#include <vector>

#include "layfigure/dynamics/model.h"
#include "rigid_groups.h"
#include "run.h"

/// A bound of the energy that a base step under gravity alone may create, that costs little beside the step.
///
/// With the projection's own loss |P' - P|^2 / 2 in the metric of the inverse masses, of which the linear momenta's
/// part is cheap, and the loss h^2 u K u / 2 of the springs that are strained by the velocity u, a step has
///     created <= G + T - h^2 sum u K u / 2 - sum |p' - p|^2 / (2 m)
/// where G is what gravity does not do on the bodies' curved ways and T what the bodies gain by turning. Seen from the
/// step's beginning a body turns by exp(h w) but for an angle of h^2 e,
///     e <= sum over its joints up to the root of |w_rel| |w| / 2  (+ |u|^2 / 4 at an anisotropic joint),
/// because |exp(a) exp(b) - exp(a + b)| <= |a x b| / 2. With the links r of the doll's skeleton that turn with the
/// body, each with the mass m that it carries, the sum of m r then ends at most |sum of m r| h^2 (w^2 / 2 + e) off the
/// way of its velocity. The body gains w d + d I^-1 d / 2, where d is the change of the angular momentum that it sees.
/// Turning about w alone changes neither w L nor d by more than h |w x L|, so that the gain is at most
///     h^2 (|w x L| + h e |L|)^2 / (2 I_min) + h^2 e |w x L| + h^4 e^2 |w| |L| / 2.
namespace layfigure::dynamics {

/// Constants of the bound, slot by slot; all 0 in an idle lane.
template <class T>
struct BoundConstants {
  T inverse_mass;
  Vec3<T> moment;      ///< sum of m r over the links that turn with the body, in its frame [kg m]
  T lever;             ///< its length
  T levers;            ///< sum of `lever` over the body and all behind it
  T largest_moment;    ///< I_max
  T inverse_smallest;  ///< 1 / I_min
  T joint_weight;      ///< 1/2 where the body has a parent
  T strain_weight;     ///< 1/4 where its joint is anisotropic
};

template <class T>
struct BoundSums {
  T linear_loss{0.0};  ///< sum |p' - p|^2 / m
  T spring_loss{0.0};  ///< sum u K u
  T levers{0.0};       ///< G / (h^2 |g|), as if all of it were gained
  T angle{0.0};        ///< bound of every e
  T spin{0.0};         ///< sum |w| |L|
  T gyration{0.0};     ///< sum |w x L|
  T turning{0.0};      ///< sum |w x L|^2 / I_min
  T momentum{0.0};     ///< sum |L|^2 / I_min
  T noise{0.0};        ///< what rounding makes of stiff joints' work
};

/// What a joint adds to e. `product`: |w_rel| |w|, `square`: |u|^2.
template <class T>
inline T bend(const BoundConstants<T>& bound, const T& product, const T& square) {
  return bound.joint_weight * product + bound.strain_weight * square;
}

/// Adds a slot's bodies: momenta p to p', L at the end, `u` the strain's rate.
template <class T>
inline void add_to_bound(const BoundConstants<T>& bound, const Constants<T>& body, const Node<T>& node,
                         const Vec3<T>& change, const Vec3<T>& momentum, const Vec3<T>& u, BoundSums<T>& sums) {
  const T w2 = dot(node.w_WB, node.w_WB);
  const T relative2 = dot(node.w_PB, node.w_PB);
  const T product = math::square_root(w2 * relative2);
  const T angle = bend(bound, product, relative2);
  const Vec3<T> gyration = cross(node.w_WB, momentum);
  const Vec3<T>& a = node.law.gain;
  sums.linear_loss = sums.linear_loss + bound.inverse_mass * dot(change, change);
  sums.spring_loss = sums.spring_loss + dot(times(u, u), body.stiffness);
  sums.levers = sums.levers + (T(0.5) * bound.lever * w2 + bound.levers * angle);
  sums.angle = sums.angle + angle;
  sums.spin = sums.spin + bound.largest_moment * w2;
  const T gyration2 = dot(gyration, gyration);
  sums.gyration = sums.gyration + math::square_root(gyration2);
  sums.turning = sums.turning + bound.inverse_smallest * gyration2;
  sums.momentum = sums.momentum + bound.inverse_smallest * dot(momentum, momentum);
  sums.noise = sums.noise + (a.x + a.y + a.z) * product;
}

// Relative rounding of the torque of a stiff joint, whose velocity is a small difference of large ones.
constexpr double kTorqueRounding = 1e-13;
// Of the terms that signed_gain() adds up, which may cancel each other.
constexpr double kMomentRounding = 1e-14;

/// A bound of G / h^2 that minds which way the bodies went: what hangs gains, what stands loses. The sum l of m r over
/// a body's links is moved by (exp(h w) - 1 - h [w]) l = h^2 w x (w x l) / 2 but for h^3 |w|^3 |l| / 6.
template <class T>
inline double signed_gain(const Vec3<double>& gravity, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  const Vec3<T> g{T(gravity.x), T(gravity.y), T(gravity.z)};
  const T most = math::square_root(dot(g, g));
  T sum{0.0};
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    const BoundConstants<T>& bound = plan.bounds[slot];
    const Node<T>& node = nodes[slot];
    const Vec3<T>& w = node.w_WB;
    const Vec3<T> l = rotate(node.orientation, bound.moment);
    const T w2 = dot(w, w);
    const T relative2 = dot(node.w_PB, node.w_PB);
    const T third = bound.lever * w2 * (node.h * math::square_root(w2) * T(1.0 / 6.0) + T(kMomentRounding));
    const T bent = bound.levers * bend(bound, math::square_root(w2 * relative2), relative2);
    sum = sum + (T(0.5) * (dot(g, l) * w2 - dot(g, w) * dot(w, l)) + most * (third + bent));
  }
  return math::total(sum);
}

/// Whether a step of length h surely created nothing, with `gain` a bound of G / h^2.
template <class T>
inline bool surely_dissipative(const BoundSums<T>& sums, double h, double gain) {
  const double angle = math::total(sums.angle);
  const double square = h * h * angle * angle;
  const double created = gain + math::total(sums.turning) + square * math::total(sums.momentum) +
                         angle * math::total(sums.gyration) + 0.5 * square * math::total(sums.spin);
  const double lost = 0.5 * math::total(sums.linear_loss) + 0.5 * h * h * math::total(sums.spring_loss);
  return h * h * created + kTorqueRounding * h * math::total(sums.noise) <= lost;
}

/// The lengths and masses of the skeleton that the bound needs, of each carrier.
struct Levers {
  explicit Levers(const RigidGroups& groups);
  void measure(const RigidGroups& groups);

  std::vector<double> carried;  ///< mass of the group and all behind it
  /// Sum over the links that turn with the group, in its frame: mass that the link carries times its way [kg m].
  std::vector<Eigen::Vector3d> moments;
  std::vector<double> behind;  ///< the lengths of these, of the group and all behind it
};

/// One entry per slot.
template <class T>
void set_bounds(const Model& model, const RigidGroups& groups, const Levers& levers, const Schedule& schedule,
                std::vector<BoundConstants<T>>& bounds);

}  // namespace layfigure::dynamics
