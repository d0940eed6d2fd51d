#pragma once

#include <cmath>

#include "drives.h"
#include "layfigure/dynamics/joint_law.h"
#include "run.h"

/// Newton's method on the joints' laws. The step minimises a convex function of the joint velocities; each linear solve
/// is exact for the laws linearised at a trial torque, so the iteration ends when every law agrees with its
/// linearisation. A line search on the convex function makes it converge from anywhere.
namespace layfigure::dynamics {

// A law agrees with its linearisation when their torques differ by this part of the trial torque ...
constexpr double kNewtonTolerance = 1e-12;
// ... or of the torque that the joint's gain makes of the body's own angular velocity: the relative velocity of a stiff
// joint is a small difference of large ones, and this is its rounding.
constexpr double kVelocityRounding = 1e-14;
// Where rounding keeps the iteration from more, in scenes that mix very stiff and very light joints, this is accepted.
constexpr double kAcceptedTolerance = 1e-8;
// Smooth flow takes 2 to 3. Every iteration past the free ones decreases a convex function.
constexpr int kMaxNewtonIterations = 60;
// Undamped iterations before the line search may act: it is not needed where the regimes settle at once.
constexpr int kFreeIterations = 2;
constexpr int kLineSearchIterations = 40;
// The line search accepts a point where the slope has fallen to this part of its first value.
constexpr double kSlopeReduction = 0.3;

/// Linearises the laws of a slot at the trial torques `trial`.
template <class T>
inline void linearize(FlowLaw kind, const Vec3<T>& trial, Node<T>& node) {
  node.trial = trial;
  node.linearized = radial_return(kind, node.law, trial);
  node.elastic = !math::any(node.linearized.flowing > T(0.0));
}

/// Torque of the linearised law at the trial torque s: share s - curvature (a u) u^T (s - s0).
template <class T>
inline Vec3<T> linearized_torque(const Node<T>& node, const Vec3<T>& s) {
  if (node.elastic) return s;
  const Return<T>& at = node.linearized;
  const T along = at.curvature * dot(at.u, s - node.trial);
  return times(at.share, s) - scaled(times(node.law.gain, at.u), along);
}

template <class T>
inline Vec3<T> trial_torque(const Node<T>& node, const Vec3<T>& w) {
  return node.elastic_torque + times(node.law.gain, w);
}

template <class T>
inline Vec3<T> law_torque(FlowLaw kind, const Node<T>& node, const Vec3<T>& s) {
  return times(radial_return(kind, node.law, s).share, s);
}

/// Square of the largest disagreement that counts as none.
template <class T>
inline T tolerated(const Node<T>& node, const Vec3<T>& s, double tolerance) {
  const T noise = dot(node.law.gain, node.law.gain) * dot(node.w_WB, node.w_WB);
  return tolerance * tolerance * dot(s, s) + kVelocityRounding * kVelocityRounding * noise;
}

template <class T>
inline bool all_laws_hold(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                          double tolerance) {
  const FlowLaw law = context.law;
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    if (!plan.constants[slot].flows) continue;
    const Vec3<T> s = trial_torque(nodes[slot], nodes[slot].w_PB);
    const Vec3<T> error = law_torque(law, nodes[slot], s) - linearized_torque(nodes[slot], s);
    if (!math::all(dot(error, error) <= tolerated(nodes[slot], s, tolerance))) return false;
  }
  return drives_hold(context, nodes, tolerance, kVelocityRounding);
}

/// Slope of the convex function at `lambda` of the way from the last iterate to the new solution, all copies together.
/// Every part of the gradient but the laws is affine on that way, and the gradient vanishes but for joints that can
/// flow, for drives, and where a constraint pushes.
template <class T>
inline double slope_at(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                       bool constrained, double lambda) {
  const FlowLaw law = context.law;
  T sum{};
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    if (!plan.constants[slot].flows) continue;
    const Node<T>& node = nodes[slot];
    const Vec3<T> d = node.w_PB - node.iterate;
    const Vec3<T> w = node.iterate + scaled(d, lambda);
    const Vec3<T> affine_new = scaled(linearized_torque(node, trial_torque(node, node.w_PB)), -node.h);
    const Vec3<T> affine = node.affine + scaled(affine_new - node.affine, lambda);
    const Vec3<T> torque = law_torque(law, node, trial_torque(node, w));
    sum = sum + dot(affine + scaled(torque, node.h), d);
  }
  double total = drive_slope(context, nodes, lambda);
  if (constrained) total += constraint_slope(context, lambda);
  for (int k = 0; k < math::LaneTraits<T>::kCount; ++k) total += math::lane(sum, k);
  return total;
}

/// How far to go towards the new solution: the whole way, unless it overshoots the minimum. 0 where the function does
/// not fall any more on the way, so that the last iterate is its minimum to rounding.
template <class T>
inline double line_search(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                          bool constrained) {
  const double start = slope_at(context, plan, nodes, constrained, 0.0);
  if (!(start < 0.0)) return 0.0;
  double low = 0.0;
  double high = 1.0;
  double lambda = 1.0;
  for (int k = 0; k < kLineSearchIterations; ++k) {
    const double slope = slope_at(context, plan, nodes, constrained, lambda);
    if (std::abs(slope) <= -kSlopeReduction * start || (slope < 0.0 && lambda == 1.0)) break;
    (slope > 0.0 ? high : low) = lambda;
    lambda = 0.5 * (low + high);
  }
  return lambda;
}

/// Accepts the new solution, or a part of the way to it, and linearises the laws there. False if there was no way to
/// go.
template <class T>
inline bool accept_iterate(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes,
                           bool constrained, int iteration) {
  if (constrained) measure_constraints(context, plan, nodes);
  const double lambda = iteration <= kFreeIterations ? 1.0 : line_search(context, plan, nodes, constrained);
  if (lambda == 0.0) return false;
  if (constrained) accept_constraints(context, lambda, iteration == 1);
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    if (!plan.constants[slot].flows) continue;
    Node<T>& node = nodes[slot];
    const Vec3<T> affine = scaled(linearized_torque(node, trial_torque(node, node.w_PB)), -node.h);
    node.affine = iteration == 1 ? affine : node.affine + scaled(affine - node.affine, lambda);
    node.iterate = iteration == 1 ? node.w_PB : node.iterate + scaled(node.w_PB - node.iterate, lambda);
    linearize(context.law, trial_torque(node, node.iterate), node);
  }
  accept_drives(context, nodes, lambda, iteration == 1);
  return true;
}

}  // namespace layfigure::dynamics
