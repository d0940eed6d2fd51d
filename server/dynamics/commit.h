#pragma once

#include <cmath>

#include "couplings.h"
#include "creation_bound.h"
#include "newton.h"

/// The end of a base step: the state that the velocities lead to, and the work that was done on the way.
namespace layfigure::dynamics {

/// w_d = (s - t) / a per axis. An axis without gain has no torque and does not flow.
template <class T>
inline Vec3<T> flow_rate(const Node<T>& node, const Vec3<T>& trial, const Vec3<T>& torque) {
  const auto rate = [](const T& excess, const T& gain) {
    const auto some = gain > T(0.0);
    return math::select(some, excess / math::select(some, gain, T(1.0)), T(0.0));
  };
  const Vec3<T> excess = trial - torque;
  const Vec3<T>& a = node.law.gain;
  return {rate(excess.x, a.x), rate(excess.y, a.y), rate(excess.z, a.z)};
}

/// The rotation from rest to which a joint moves with the velocity w: exp(q) exp(h w), or exp(q + h w) for the rate of
/// an anisotropic joint's strain.
template <class T>
inline Quat<T> strained(const Constants<T>& body, const Node<T>& node, const Vec3<T>& w) {
  const Quat<T> elastic = conjugate(node.before.rest) * node.before.rotation;
  if (body.isotropic) return elastic * math::exp_rotation(scaled(w, node.h));
  const Vec3<T> turn = scaled(w, node.h);
  const Quat<T> by_rate = math::exp_rotation(rotate(body.section, node.strain + turn));
  return math::select(body.anisotropic > T(0.0), by_rate, elastic * math::exp_rotation(turn));
}

/// Work that the bodies of the last copy did, lane by lane.
template <class T>
struct Losses {
  T viscous{0.0};
  T flow{0.0};
};

/// Moves the rest rotations of the joints that flow, so that they are strained by the elastic part of the motion.
template <class T>
inline void flow(const Constants<T>& body, const Node<T>& node, const Vec3<T>& torque, const Vec3<T>& w_d,
                 Bodies<T>& next, Losses<T>& losses) {
  const auto flowing = node.linearized.flowing > T(0.0);
  const T work = node.h * dot(torque, w_d);
  const T norm = math::square_root(squared_norm(node.law, torque));
  const auto some = flowing && norm > T(0.0);
  next.flow = node.before.flow + math::select(some, work / math::select(some, norm, T(1.0)), T(0.0));
  losses.flow = losses.flow + math::select(flowing && body.reported > T(0.0), work, T(0.0));
  const Quat<T> elastic = strained(body, node, node.w_PB - w_d);
  next.rest = math::select(flowing, renormalized(next.rotation * conjugate(elastic)), node.before.rest);
}

/// Work that the loads do on a slot's bodies, `velocity` being that of the com.
template <class T>
inline void account_loads(const StepContext& context, const Plan<T>& plan, const Node<T>& node, int slot,
                          const Vec3<T>& velocity) {
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.idle) continue;
    Copy& copy = context.copies[task.copy];
    const BodyForce& load = copy.loads[task.body];
    copy.work.input += copy.h * (load.force.dot(lane(velocity, k)) + load.torque.dot(lane(node.w_WB, k)));
  }
}

template <class T>
inline T remaining_slack(const Constants<T>& body, const Node<T>& node) {
  const T left = math::maximum(node.slack - node.h * math::square_root(dot(node.w_PB, node.w_PB)), T(0.0));
  return math::select(body.unlimited > T(0.0), node.before.limit_slack, left);
}

/// The joints' rotations at the end.
template <class T>
inline Quat<T> turned(const Constants<T>& body, const Node<T>& node) {
  const Before<T>& now = node.before;
  if (body.isotropic) return renormalized(now.rotation * math::exp_rotation(scaled(node.w_PB, node.h)));
  return renormalized(math::select(body.anisotropic > T(0.0), now.rest * strained(body, node, node.w_PB),
                                   now.rotation * math::exp_rotation(scaled(node.w_PB, node.h))));
}

/// A torque of the laws in the bodies' axes.
template <class T>
inline Vec3<T> in_body(const Constants<T>& body, const Node<T>& node, const Vec3<T>& torque) {
  if (body.isotropic) return torque;
  return math::select(body.anisotropic > T(0.0), rotate(conjugate(node.orientation), node.axes * torque), torque);
}

/// Moves the configuration with the new velocities, the rest rotations with the flow, and keeps the new momenta.
/// Returns 0, or NaN in a lane whose state is not finite. Adds to `bound` if there is one.
template <class T>
inline T commit(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot,
                Losses<T>& losses, BoundSums<T>* bound) {
  const Constants<T>& body = plan.constants[slot];
  const Node<T>& node = nodes[slot];
  const Before<T>& now = node.before;
  Bodies<T> next;
  next.rest = now.rest;
  next.flow = now.flow;
  next.yield_scale = now.yield_scale;
  next.limit_slack = body.limited ? remaining_slack(body, node) : now.limit_slack;
  next.rotation = turned(body, node);
  const Vec3<T> velocity = node.v_WB + cross(node.w_WB, node.c);
  next.linear_momentum = scaled(velocity, body.mass);
  next.angular_momentum =
      scaled(node.w_WB, body.inertia) + scaled(node.u, dot(node.u, node.w_WB)) + scaled(node.v, dot(node.v, node.w_WB));
  next.trial_torque = trial_torque(node, node.w_PB);
  const Vec3<T> torque = linearized_torque(node, next.trial_torque);
  Vec3<T> w_f = node.w_PB;
  if (!node.elastic) {
    const Vec3<T> w_d = flow_rate(node, next.trial_torque, torque);
    flow(body, node, torque, w_d, next, losses);
    w_f = w_f - w_d;
  }
  const T viscous = node.h * dot(times(w_f, w_f), body.damping);
  losses.viscous = losses.viscous + math::select(body.reported > T(0.0), viscous, T(0.0));
  if (context.inputs->loads != nullptr) account_loads(context, plan, node, slot, velocity);
  if (bound != nullptr) {
    add_to_bound(plan.bounds[slot], body, node, next.linear_momentum - now.linear_momentum, next.angular_momentum, w_f,
                 *bound);
  }
  write_bodies(context, plan, slot, node, next, in_body(body, node, torque));
  const T sum = next.rotation.w + next.rest.w + dot(next.linear_momentum, next.linear_momentum) +
                dot(next.angular_momentum, next.angular_momentum) + dot(torque, torque);
  return sum - sum;
}

/// Commits all slots; sets what the report says of the new state.
template <class T>
inline void commit_all(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                       SolveReport& report) {
  measure_couplings(context, plan, nodes);
  measure_drives(context, nodes);
  if (report.constrained || !plan.limited.empty()) finish_constraints(context, plan, nodes);
  T probe{};
  Losses<T> losses;
  BoundSums<T> bound;
  const Inputs& inputs = *context.inputs;
  const bool bounded = context.minds_energy && !report.constrained && inputs.loads == nullptr &&
                       inputs.couplings.empty() && inputs.drives.empty();
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    probe = probe + commit(context, plan, nodes, slot, losses, bounded ? &bound : nullptr);
  }
  Work& work = context.copies.back().work;
  work.viscous += math::total(losses.viscous);
  work.flow += math::total(losses.flow);
  report.finite = math::all(probe == T(0.0));
  if (!bounded) return;
  const double h = context.copies[0].h;
  const double most = std::sqrt(dot(context.gravity, context.gravity)) * math::total(bound.levers);
  report.dissipative =
      surely_dissipative(bound, h, most) || surely_dissipative(bound, h, signed_gain(context.gravity, plan, nodes));
}

}  // namespace layfigure::dynamics
