#pragma once

#include <cmath>

#include "layfigure/dynamics/joint_law.h"
#include "run.h"

/// Newton's method on the joints' laws. The step minimises a convex function of the joint velocities; each linear solve
/// is exact for the laws linearised at a trial torque, so the iteration ends when every law agrees with its
/// linearisation. A line search on the convex function makes it converge from anywhere.
namespace layfigure::dynamics {

// A law agrees with its linearisation when their torques differ by this part of the trial torque: what the rounding of
// a step leaves, with two digits to spare.
constexpr double kNewtonTolerance = 1e-12;
// Smooth flow takes 2 to 3. Every iteration past the free ones decreases a convex function.
constexpr int kMaxNewtonIterations = 60;
// Undamped iterations before the line search may act: it is not needed where the regimes settle at once.
constexpr int kFreeIterations = 2;
constexpr int kLineSearchIterations = 40;
// The line search accepts a point where the slope has fallen to this part of its first value.
constexpr double kSlopeReduction = 0.3;

/// Linearises the laws of a slot at the trial torques `trial` (child's axes).
template <class T>
inline void linearize(FlowLaw law, const Constants<T>& body, const Vec3<T>& trial, Node<T>& node) {
  node.trial = trial;
  const auto ret = radial_return(law, node.gain, body.flow_damping, body.yield, math::square_root(dot(trial, trial)));
  node.radial = ret.radial;
  node.tangential = ret.tangential;
  node.isotropic = math::all(ret.radial == ret.tangential);
}

/// dt/ds of the linearised law: identity 1 + dyad axis axis^T.
template <class T>
struct RankOne {
  T identity;
  T dyad;
  Vec3<T> axis;
};

template <class T>
inline RankOne<T> law_slope(const Node<T>& node) {
  const T norm2 = dot(node.trial, node.trial);
  return {node.tangential, (node.radial - node.tangential) / math::select(norm2 > T(0.0), norm2, T(1.0)), node.trial};
}

/// Torque of the linearised law at the trial torque s: (tangential - radial) s0 + dt/ds s.
template <class T>
inline Vec3<T> linearized_torque(const Node<T>& node, const Vec3<T>& s) {
  if (node.isotropic) return scaled(s, node.tangential);
  const RankOne<T> slope = law_slope(node);
  const T along = slope.dyad * dot(s, slope.axis) + (node.tangential - node.radial);
  return scaled(s, slope.identity) + scaled(slope.axis, along);
}

template <class T>
inline Vec3<T> trial_torque(const Constants<T>& body, const Node<T>& node, const Vec3<T>& w) {
  return scaled(node.strain, body.stiffness) + scaled(w, node.gain);
}

template <class T>
inline Vec3<T> law_torque(FlowLaw law, const Constants<T>& body, const Node<T>& node, const Vec3<T>& s) {
  const auto ret = radial_return(law, node.gain, body.flow_damping, body.yield, math::square_root(dot(s, s)));
  return scaled(s, ret.tangential);
}

template <class T>
inline bool all_laws_hold(FlowLaw law, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    const Constants<T>& body = plan.constants[slot];
    if (!body.flows) continue;
    const Vec3<T> s = trial_torque(body, nodes[slot], nodes[slot].w_PB);
    const Vec3<T> error = law_torque(law, body, nodes[slot], s) - linearized_torque(nodes[slot], s);
    if (!math::all(dot(error, error) <= kNewtonTolerance * kNewtonTolerance * dot(s, s))) return false;
  }
  return true;
}

/// Slope of the convex function at `lambda` of the way from the last iterate to the new solution, all copies together.
/// Every part of the gradient but the laws is affine on that way, and the gradient vanishes but for joints that can
/// flow.
template <class T>
inline double slope_at(FlowLaw law, const Plan<T>& plan, const std::vector<Node<T>>& nodes, double lambda) {
  T sum{};
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    const Constants<T>& body = plan.constants[slot];
    if (!body.flows) continue;
    const Node<T>& node = nodes[slot];
    const Vec3<T> d = node.w_PB - node.iterate;
    const Vec3<T> w = node.iterate + scaled(d, lambda);
    const Vec3<T> affine_new = scaled(linearized_torque(node, trial_torque(body, node, node.w_PB)), -node.h);
    const Vec3<T> affine = node.affine + scaled(affine_new - node.affine, lambda);
    const Vec3<T> torque = law_torque(law, body, node, trial_torque(body, node, w));
    sum = sum + dot(affine + scaled(torque, node.h), d);
  }
  double total = 0.0;
  for (int k = 0; k < math::LaneTraits<T>::kCount; ++k) total += math::lane(sum, k);
  return total;
}

/// How far to go towards the new solution, in (0, 1]: the whole way unless it overshoots the minimum.
template <class T>
inline double line_search(FlowLaw law, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  const double accepted = kSlopeReduction * std::abs(slope_at(law, plan, nodes, 0.0));
  double low = 0.0;
  double high = 1.0;
  double lambda = 1.0;
  for (int k = 0; k < kLineSearchIterations; ++k) {
    const double slope = slope_at(law, plan, nodes, lambda);
    if (std::abs(slope) <= accepted || (slope < 0.0 && lambda == 1.0)) break;
    (slope > 0.0 ? high : low) = lambda;
    lambda = 0.5 * (low + high);
  }
  return lambda;
}

/// Accepts the new solution, or a part of the way to it, and linearises the laws there.
template <class T>
inline void accept_iterate(FlowLaw law, const Plan<T>& plan, std::vector<Node<T>>& nodes, int iteration) {
  const double lambda = iteration <= kFreeIterations ? 1.0 : line_search(law, plan, nodes);
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    const Constants<T>& body = plan.constants[slot];
    if (!body.flows) continue;
    Node<T>& node = nodes[slot];
    const Vec3<T> affine = scaled(linearized_torque(node, trial_torque(body, node, node.w_PB)), -node.h);
    node.affine = iteration == 1 ? affine : node.affine + scaled(affine - node.affine, lambda);
    node.iterate = iteration == 1 ? node.w_PB : node.iterate + scaled(node.w_PB - node.iterate, lambda);
    linearize(law, body, trial_torque(body, node, node.iterate), node);
  }
}

}  // namespace layfigure::dynamics
