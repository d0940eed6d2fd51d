#pragma once

#include <algorithm>
#include <array>
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

/// The lanes in which the law agrees with its linearisation.
template <class T>
inline auto holds(FlowLaw law, const Node<T>& node, double tolerance) {
  const Vec3<T> s = trial_torque(node, node.w_PB);
  const Vec3<T> error = law_torque(law, node, s) - linearized_torque(node, s);
  return dot(error, error) <= tolerated(node, s, tolerance);
}

/// Finds the copies that have not settled whose laws all hold; the others are not `converged`.
template <class T>
inline void judge(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                  double tolerance) {
  int hopeful = 0;  // copies of which nothing has been found yet that does not hold
  for (Copy& copy : context.copies) {
    if (copy.settled) continue;
    copy.converged = drives_hold(copy, nodes, tolerance, kVelocityRounding);
    hopeful += copy.converged ? 1 : 0;
  }
  for (int slot = 0; slot < plan.schedule.size() && hopeful > 0; ++slot) {
    if (!plan.constants[slot].flows) continue;
    const auto held = holds(context.law, nodes[slot], tolerance);
    if (math::all(held)) continue;
    for (int k = 0; k < kLanes<T>; ++k) {
      const Task& task = plan.schedule.tasks(slot)[k];
      Copy& copy = context.copies[task.copy];
      if (task.idle || copy.settled || !copy.converged || math::lane(held, k)) continue;
      copy.converged = false;
      --hopeful;
    }
  }
}

inline void settle(Copy& copy, int iteration) {
  copy.settled = true;
  copy.solves = iteration;
  copy.fraction = 0.0;
}

inline bool is_to_put_by(const Copy& copy, int iteration) {
  return copy.constrained && copy.settled && copy.solves == iteration;
}
inline bool was_put_by(const Copy& copy, int iterations) { return copy.constrained && copy.solves < iterations; }

/// What `number` tells of each lane's copy.
template <class T, class F>
inline T of_copies(const StepContext& context, const Plan<T>& plan, int slot, const F& number) {
  const Task* tasks = plan.schedule.tasks(slot);
  return math::from_lanes<T>([&](int k) { return number(context.copies[tasks[k].copy]); });
}

/// Puts by the velocities of copies with constraints that have settled in this iteration: the impulses are in them, but
/// in no later factor. Those of other copies come out the same again, as their laws keep their linearisations.
template <class T>
inline void put_by(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int iteration) {
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    Node<T>& node = nodes[slot];
    const T now = of_copies(context, plan, slot,
                            [iteration](const Copy& copy) { return is_to_put_by(copy, iteration) ? 1.0 : 0.0; });
    node.put_by = select(now > T(0.0), {node.w_WB, node.v_WB, node.w_PB}, node.put_by);
  }
}

/// Takes them out again after the last iteration.
template <class T>
inline void take_out(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int iterations) {
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    Node<T>& node = nodes[slot];
    const T early = of_copies(context, plan, slot,
                              [iterations](const Copy& copy) { return was_put_by(copy, iterations) ? 1.0 : 0.0; });
    const BodyVelocities<T> all = select(early > T(0.0), node.put_by, {node.w_WB, node.v_WB, node.w_PB});
    node.w_WB = all.w_WB;
    node.v_WB = all.v_WB;
    node.w_PB = all.w_PB;
  }
}

/// Slope of each copy's convex function at its fraction of the way from the last iterate to the new solution. Every
/// part of the gradient but the laws is affine on that way, and the gradient vanishes but for joints that can flow, for
/// drives, and where a constraint pushes. Summed in tree order, whatever the schedule.
template <class T>
inline std::array<double, kMaxOrder> slopes(const StepContext& context, const Plan<T>& plan,
                                            std::vector<Node<T>>& nodes) {
  const FlowLaw law = context.law;
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    if (!plan.constants[slot].flows) continue;
    Node<T>& node = nodes[slot];
    const T lambda = of_copies(context, plan, slot, [](const Copy& copy) { return copy.fraction; });
    const Vec3<T> d = node.w_PB - node.iterate;
    const Vec3<T> w = node.iterate + scaled(d, lambda);
    const Vec3<T> affine_new = scaled(linearized_torque(node, trial_torque(node, node.w_PB)), -node.h);
    const Vec3<T> affine = node.affine + scaled(affine_new - node.affine, lambda);
    const Vec3<T> torque = law_torque(law, node, trial_torque(node, w));
    node.slope = dot(affine + scaled(torque, node.h), d);
  }
  std::array<double, kMaxOrder> sums;
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    sums[k] = drive_slope(context.copies[k], nodes) + constraint_slope(context.copies[k]);
    for (const int body : plan.flowing) {
      sums[k] += math::lane(nodes[plan.schedule.slot_of(k, body)].slope, plan.schedule.lane_of(k, body));
    }
  }
  return sums;
}

/// How far each copy goes towards its new solution: the whole way, unless it overshoots the minimum. A copy whose
/// function does not fall any more on the way settles: the last iterate is its minimum to rounding.
template <class T>
inline void line_search(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int iteration) {
  struct Search {
    double low{0.0};
    double high{1.0};
    bool going{false};
  };
  std::array<Search, kMaxOrder> searches;
  const int copies = static_cast<int>(context.copies.size());
  for (Copy& copy : context.copies) copy.fraction = 0.0;
  const std::array<double, kMaxOrder> start = slopes(context, plan, nodes);
  for (int k = 0; k < copies; ++k) {
    Copy& copy = context.copies[k];
    if (copy.settled) continue;
    copy.fraction = 1.0;
    searches[k].going = start[k] < 0.0;
    if (searches[k].going) continue;
    copy.converged = true;
    settle(copy, iteration);
  }
  const auto going = [](const Search& search) { return search.going; };
  for (int n = 0; n < kLineSearchIterations && std::any_of(searches.begin(), searches.begin() + copies, going); ++n) {
    const std::array<double, kMaxOrder> slope = slopes(context, plan, nodes);
    for (int k = 0; k < copies; ++k) {
      Search& search = searches[k];
      double& lambda = context.copies[k].fraction;
      if (!search.going) continue;
      search.going = !(std::abs(slope[k]) <= -kSlopeReduction * start[k] || (slope[k] < 0.0 && lambda == 1.0));
      if (!search.going) continue;
      (slope[k] > 0.0 ? search.high : search.low) = lambda;
      lambda = 0.5 * (search.low + search.high);
    }
  }
}

/// Accepts the new solutions, or parts of the way to them, and linearises the laws there, but for those of copies that
/// have settled.
template <class T>
inline void accept_iterates(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes,
                            int iteration) {
  accept_constraints(context, iteration == 1);
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    if (!plan.constants[slot].flows) continue;
    Node<T>& node = nodes[slot];
    const T lambda = of_copies(context, plan, slot, [](const Copy& copy) { return copy.fraction; });
    const Vec3<T> affine = scaled(linearized_torque(node, trial_torque(node, node.w_PB)), -node.h);
    node.affine = iteration == 1 ? affine : node.affine + scaled(affine - node.affine, lambda);
    node.iterate = iteration == 1 ? node.w_PB : node.iterate + scaled(node.w_PB - node.iterate, lambda);
    linearize(context.law, math::select(lambda > T(0.0), trial_torque(node, node.iterate), node.trial), node);
  }
  accept_drives(context, nodes, iteration == 1);
}

/// Goes on from iteration `iteration`, whose solutions are not those of all copies. Returns whether some copy has not
/// settled.
template <class T>
inline bool improve(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int iteration) {
  measure_constraints(context, plan, nodes);
  if (iteration > kFreeIterations) line_search(context, plan, nodes, iteration);
  const auto settled = [](const Copy& copy) { return copy.settled; };
  if (std::all_of(context.copies.begin(), context.copies.end(), settled)) return false;
  const auto now = [iteration](const Copy& copy) { return is_to_put_by(copy, iteration); };
  if (std::any_of(context.copies.begin(), context.copies.end(), now)) put_by(context, plan, nodes, iteration);
  accept_iterates(context, plan, nodes, iteration);
  return true;
}

}  // namespace layfigure::dynamics
