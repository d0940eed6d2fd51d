#pragma once

#include "articulated.h"
#include "lane_transfer.h"
#include "newton.h"

/// The base step (step.h), generic in the scalar. Inlined whole into the functions of base_step.cpp, so that each is
/// compiled once per instruction set.
namespace layfigure::dynamics {

template <class T>
inline T step_lengths(const StepContext& context, const Plan<T>& plan, int slot) {
  T h;
  for (int k = 0; k < kLanes<T>; ++k) {
    math::set_lane(h, k, context.copies[std::max(plan.schedule.tasks(slot)[k].copy, 0)].h);
  }
  return h;
}

/// Impulses of the scene's loads on the bodies of a slot, taken at the end of the sub-step.
template <class T>
inline void add_loads(const StepContext& context, const Plan<T>& plan, int slot, Node<T>& node) {
  Vec3<T> force{};
  Vec3<T> torque{};
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.copy < 0) continue;
    const BodyForce& load = context.copies[task.copy].loads[task.body];
    math::set_lane(force, k, load.force);
    math::set_lane(torque, k, load.torque);
  }
  node.target_linear += scaled(force, node.h);
  node.target_angular += scaled(torque, node.h);
}

/// World pose, inertia axes, strain and free momenta of a slot's bodies; their parents' are known.
template <class T>
inline void update_kinematics(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int slot) {
  const Constants<T>& body = plan.constants[slot];
  const Bodies<T> now = read_bodies(context, plan, slot);
  Node<T>& node = nodes[slot];
  node.h = step_lengths(context, plan, slot);
  const Quat<T> parent = of_parents(plan, nodes, slot, &Node<T>::orientation);
  node.orientation = renormalized(parent * now.rotation);
  node.r = rotate(parent, body.anchor);
  node.R = matrix(node.orientation);
  node.c = node.R * body.com;
  node.u = node.R * body.u;
  node.v = node.R * body.v;
  const T mh = node.h * body.mass;
  const Vec3<double>& g = context.gravity;
  node.target_linear = now.linear_momentum + Vec3<T>{mh * g.x, mh * g.y, mh * g.z};
  node.target_angular = now.angular_momentum;
  if (context.inputs->loads != nullptr) add_loads(context, plan, slot, node);
  node.gain = node.h * body.stiffness + body.damping;
  node.strain = log_rotation(conjugate(now.rest) * now.rotation);
  if (body.flows) {
    linearize(context.law, body, now.trial_torque, node);
  } else {
    node.radial = node.tangential = T(1.0);
    node.isotropic = true;
  }
}

/// A coupling over one sub-step: force = pull - resistance u, with u the velocity of the held point (or of the held
/// frame).
struct CouplingTerms {
  Vec3<double> r;  ///< held point from the body's origin, world
  double resistance;
  Vec3<double> pull;
  double angular_resistance;
  Vec3<double> angular_pull;
};

/// p_WBo of the body in one lane, summed along its path to the root.
template <class T>
inline Vec3<double> origin_of(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                              int copy, int body) {
  Vec3<double> origin{0.0, 0.0, 0.0};
  Task task{.copy = copy,
            .body = body,
            .parent_slot = plan.schedule.slot_of(copy, body),
            .parent_lane = plan.schedule.lane_of(copy, body)};
  while (true) {
    const int slot = task.parent_slot;
    const int lane = task.parent_lane;
    task = plan.schedule.tasks(slot)[lane];
    if (task.parent_slot == plan.schedule.size()) break;
    origin += math::lane_of(nodes[slot].r, lane);
  }
  const Eigen::Vector3d& root = context.copies[copy].from[task.body].position;
  return origin + math::broadcast<double>(root);
}

template <class T>
inline CouplingTerms coupling_terms(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                                    int copy, const Coupling& coupling) {
  const int slot = plan.schedule.slot_of(copy, coupling.body);
  const int lane = plan.schedule.lane_of(copy, coupling.body);
  const Quat<double> orientation = math::lane_of(nodes[slot].orientation, lane);
  const double h = context.copies[copy].h;
  const double end = context.copies[copy].offset + h;
  const auto target_velocity = math::broadcast<double>(coupling.target_velocity);
  const auto target_spin = math::broadcast<double>(coupling.target_angular_velocity);
  CouplingTerms terms;
  terms.r = rotate(orientation, math::broadcast<double>(coupling.point));
  const Vec3<double> target = math::broadcast<double>(coupling.target_position) + scaled(target_velocity, end);
  const Vec3<double> held = origin_of(context, plan, nodes, copy, coupling.body) + terms.r;
  terms.resistance = h * coupling.stiffness + coupling.damping;
  terms.pull = scaled(target - held, coupling.stiffness) + scaled(target_velocity, coupling.damping);
  const Quat<double> wanted =
      math::exp_rotation(scaled(target_spin, end)) * math::broadcast<double>(coupling.target_rotation);
  const Quat<double> frame = orientation * math::broadcast<double>(coupling.orientation);
  terms.angular_resistance = h * coupling.angular_stiffness + coupling.angular_damping;
  terms.angular_pull = scaled(math::log_rotation(wanted * conjugate(frame)), coupling.angular_stiffness) +
                       scaled(target_spin, coupling.angular_damping);
  return terms;
}

template <class T>
inline void add_couplings(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  for (int copy = 0; copy < static_cast<int>(context.copies.size()); ++copy) {
    const double h = context.copies[copy].h;
    for (const Coupling& coupling : context.inputs->couplings) {
      const CouplingTerms terms = coupling_terms(context, plan, nodes, copy, coupling);
      const auto spring = spring_terms(terms.r, h * terms.resistance, scaled(terms.pull, h),
                                       h * terms.angular_resistance, scaled(terms.angular_pull, h));
      add_lane(spring, nodes[plan.schedule.slot_of(copy, coupling.body)].articulated,
               plan.schedule.lane_of(copy, coupling.body));
    }
  }
}

template <class T>
inline void measure_couplings(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  const auto couplings = context.inputs->couplings;
  for (int copy = 0; copy < static_cast<int>(context.copies.size()); ++copy) {
    for (std::size_t k = 0; k < couplings.size(); ++k) {
      const CouplingTerms terms = coupling_terms(context, plan, nodes, copy, couplings[k]);
      const Node<T>& node = nodes[plan.schedule.slot_of(copy, couplings[k].body)];
      const int lane = plan.schedule.lane_of(copy, couplings[k].body);
      const Vec3<double> spin = math::lane_of(node.w_WB, lane);
      const Vec3<double> velocity = math::lane_of(node.v_WB, lane) + cross(spin, terms.r);
      context.copies[copy].coupling_forces[k] = {
          math::lane(terms.pull - scaled(velocity, terms.resistance), 0),
          math::lane(terms.angular_pull - scaled(spin, terms.angular_resistance), 0)};
    }
  }
}

/// Eliminates a slot's joints from the leaves' side and adds them to their parents.
template <class T>
inline void eliminate_joints(const Plan<T>& plan, std::vector<Node<T>>& nodes, int slot) {
  const Constants<T>& body = plan.constants[slot];
  Node<T>& node = nodes[slot];
  const T ha = node.h * node.gain;
  if (node.isotropic) [[likely]] {
    const T hk = node.h * body.stiffness * node.tangential;
    const auto up = eliminate(node, IsotropicGain<T>{ha * node.tangential}, node.R * scaled(node.strain, -hk));
    add_to_parents(plan, nodes, slot, shifted(up, node.r));
  } else {
    const RankOne<T> slope = law_slope(node);
    const Vec3<T> residual = scaled(linearized_torque(node, scaled(node.strain, body.stiffness)), -node.h);
    const Sym3<T> G = math::isotropic_plus_dyad(T(ha * slope.identity), T(ha * slope.dyad), node.R * slope.axis);
    const auto up = eliminate(node, G, node.R * residual);
    add_to_parents(plan, nodes, slot, shifted(up, node.r));
  }
}

template <class T>
inline void update_velocities(const Plan<T>& plan, std::vector<Node<T>>& nodes, int slot) {
  const Constants<T>& body = plan.constants[slot];
  Node<T>& node = nodes[slot];
  const Vec3<T> W = of_parents(plan, nodes, slot, &Node<T>::w_WB);
  node.v_WB = of_parents(plan, nodes, slot, &Node<T>::v_WB) + cross(W, node.r);
  node.w_WB = node.y + node.P * W - node.B * node.v_WB;
  if (body.roots) {
    Vec3<T> w, v;
    solve_free_root(node.articulated, w, v);
    const auto free = body.free > 0.0;
    const auto fixed = body.fixed > 0.0;
    node.w_WB = math::select(free, w, math::select(fixed, Vec3<T>{}, node.w_WB));
    node.v_WB = math::select(free, v, node.v_WB);
  }
  node.w_PB = transposed_times(node.R, node.w_WB - W);
}

/// Solves the step's convex problem: Newton's method on the joints' laws, an O(n) solve of the whole tree each.
template <class T>
inline SolveReport solve(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  SolveReport report;
  const int slots = plan.schedule.size();
  while (true) {
    for (int slot = 0; slot < slots; ++slot) assemble(plan.constants[slot], nodes[slot]);
    add_couplings(context, plan, nodes);
    for (int slot = slots - 1; slot >= 0; --slot) eliminate_joints(plan, nodes, slot);
    for (int slot = 0; slot < slots; ++slot) update_velocities(plan, nodes, slot);
    ++report.solves;
    report.converged = all_laws_hold(context.law, plan, nodes);
    if (report.converged || report.solves >= kMaxNewtonIterations) return report;
    accept_iterate(context.law, plan, nodes, report.solves);
  }
}

/// Moves the configuration with the new velocities, the rest rotations with the flow, and keeps the new momenta.
/// Returns 0, or NaN in a lane whose state is not finite.
template <class T>
inline T commit(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot) {
  const Constants<T>& body = plan.constants[slot];
  const Node<T>& node = nodes[slot];
  const Bodies<T> now = read_bodies(context, plan, slot);
  Bodies<T> next = now;
  next.rotation = renormalized(now.rotation * math::exp_rotation(scaled(node.w_PB, node.h)));
  next.linear_momentum = scaled(node.v_WB + cross(node.w_WB, node.c), body.mass);
  next.angular_momentum =
      scaled(node.w_WB, body.inertia) + scaled(node.u, dot(node.u, node.w_WB)) + scaled(node.v, dot(node.v, node.w_WB));
  next.trial_torque = trial_torque(body, node, node.w_PB);
  Vec3<T> torque = next.trial_torque;
  if (body.flows) {
    torque = linearized_torque(node, next.trial_torque);
    const auto flowing = node.tangential < T(1.0);
    if (math::any(flowing)) {
      // w_f = w - (s - t) / a, and exp(q_f[n+1]) = exp(q_f[n]) exp(h w_f)
      const T a = math::select(node.gain > T(0.0), node.gain, T(1.0));
      const Vec3<T> w_f = node.w_PB - scaled(next.trial_torque - torque, T(1.0) / a);
      const Quat<T> elastic = conjugate(now.rest) * now.rotation * math::exp_rotation(scaled(w_f, node.h));
      next.rest = math::select(flowing, renormalized(next.rotation * conjugate(elastic)), now.rest);
    }
  }
  write_bodies(context, plan, slot, node, next, torque);
  const T sum = next.rotation.w + next.rest.w + dot(next.linear_momentum, next.linear_momentum) +
                dot(next.angular_momentum, next.angular_momentum) + dot(torque, torque);
  return sum - sum;
}

template <class T>
inline SolveReport base_step_of(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  const int slots = plan.schedule.size();
  Node<T>& world = nodes[slots];
  world.orientation = {T(1.0), T(0.0), T(0.0), T(0.0)};
  world.w_WB = world.v_WB = Vec3<T>{};
  for (int slot = 0; slot < slots; ++slot) update_kinematics(context, plan, nodes, slot);
  SolveReport report = solve(context, plan, nodes);
  measure_couplings(context, plan, nodes);
  T probe{};
  for (int slot = 0; slot < slots; ++slot) probe = probe + commit(context, plan, nodes, slot);
  report.finite = math::all(probe == T(0.0));
  return report;
}

}  // namespace layfigure::dynamics
