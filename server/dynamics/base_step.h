#pragma once

#include <algorithm>
#include <limits>

#include "articulated.h"
#include "commit.h"
#include "couplings.h"
#include "lane_transfer.h"
#include "newton.h"
#include "strain.h"

/// The base step (step.h), generic in the scalar. Inlined whole into the functions of base_step.cpp and
/// narrow_base_step.cpp, so that each is compiled once per instruction set.
namespace layfigure::dynamics {

template <class T>
inline T step_lengths(const StepContext& context, const Plan<T>& plan, int slot) {
  const Task* tasks = plan.schedule.tasks(slot);
  return math::from_lanes<T>([&](int k) { return context.copies[tasks[k].copy].h; });
}

/// Impulses of the scene's loads on the bodies of a slot, taken at the end of the sub-step.
template <class T>
inline void add_loads(const StepContext& context, const Plan<T>& plan, int slot, Node<T>& node) {
  Vec3<T> force{};
  Vec3<T> torque{};
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.idle) continue;
    const BodyForce& load = context.copies[task.copy].loads[task.body];
    math::set_lane(force, k, load.force);
    math::set_lane(torque, k, load.torque);
  }
  node.target_linear += scaled(force, node.h);
  node.target_angular += scaled(torque, node.h);
}

/// The joints' strains and the axes that their laws are written in: those of the section; if the law differs between
/// them, the ones in which velocities are the rates of the strain's rotation vector.
template <class T>
inline void update_strain(const Constants<T>& body, const Bodies<T>& now, const Mat3<T>& R, Node<T>& node) {
  const Quat<T> elastic = conjugate(now.rest) * now.rotation;
  const Vec3<T> strain = log_rotation(elastic);
  node.skewed = !body.isotropic;
  if (body.isotropic) {
    node.axes = R;
    node.elastic_torque = times(body.stiffness, strain);
    return;
  }
  const auto anisotropic = body.anisotropic > T(0.0);
  node.strain = math::select(anisotropic, rotate(conjugate(body.section), strain), strain);
  node.elastic_torque = times(body.stiffness, node.strain);
  const StrainRate<T> rate = strain_rate(elastic, node.strain);
  const Mat3<T> section = matrix(node.orientation * body.section);
  node.axes = math::select(anisotropic, section * rate.B_transposed, R);
  node.motion = math::select(anisotropic, section * rate.J, R);
}

/// The joints' laws over this step, linearised where the last step left them.
template <class T>
inline void update_law(FlowLaw kind, const Constants<T>& body, const Bodies<T>& now, Node<T>& node) {
  const T& h = node.h;
  node.law.gain = scaled(body.stiffness, h) + body.damping;
  node.elastic = true;
  if (!body.flows) return;
  node.law.inverse_shape = body.inverse_shape;
  node.law.flow_damping = body.flow_damping;
  node.law.hardening = body.hardening * h * now.yield_scale;
  // An elastic joint stays elastic at any scale: infinity times a scale of 0 must not be NaN.
  const auto finite = body.yield < T(std::numeric_limits<double>::infinity());
  node.law.yield = math::select(finite, (body.yield + body.hardening * now.flow) * now.yield_scale, body.yield);
  linearize(kind, now.trial_torque, node);
}

/// World pose, inertia axes, law and free momenta of a slot's bodies; their parents' are known.
template <class T>
inline void update_kinematics(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int slot) {
  const Constants<T>& body = plan.constants[slot];
  Node<T>& node = nodes[slot];
  const Bodies<T> now = read_bodies(context, plan, slot);
  node.before = {.rotation = now.rotation,
                 .rest = now.rest,
                 .linear_momentum = now.linear_momentum,
                 .flow = now.flow,
                 .yield_scale = now.yield_scale,
                 .limit_slack = now.limit_slack};
  node.h = step_lengths(context, plan, slot);
  node.held = node.driven = false;
  const Quat<T> carrier = orientations_of_parents(plan, nodes, slot);
  const Quat<T> parent = body.mounted ? carrier * body.mount : carrier;
  node.orientation = renormalized(parent * now.rotation);
  keep_orientations(plan, slot, node);
  node.r = rotate(carrier, body.anchor);
  const Mat3<T> R = matrix(node.orientation);
  update_strain(body, now, R, node);
  node.c = R * body.com;
  node.u = R * body.u;
  node.v = R * body.v;
  const T mh = node.h * body.mass;
  const Vec3<double>& g = context.gravity;
  node.target_linear = now.linear_momentum + Vec3<T>{mh * g.x, mh * g.y, mh * g.z};
  node.target_angular = now.angular_momentum;
  if (context.inputs->loads != nullptr) add_loads(context, plan, slot, node);
  if (body.limited) node.slack = now.limit_slack + body.unlimited;
  update_law(context.law, body, now, node);
}

/// Velocities of the lanes that hold a free or a fixed root.
template <class T>
inline void update_roots(const Constants<T>& body, const Vec3<T>& W, Node<T>& node) {
  Vec3<T> w, v;
  solve_free_root(node.root, w, v);
  const auto free = body.free > T(0.0);
  const auto fixed = body.fixed > T(0.0);
  node.w_WB = math::select(free, w, math::select(fixed, Vec3<T>{}, node.w_WB));
  node.v_WB = math::select(free, v, node.v_WB);
  node.w_PB = math::select(free || fixed, transposed_times(node.axes, node.w_WB - W), node.w_PB);
}

template <class T>
inline Sym3<T> diagonal(const Vec3<T>& d) {
  return {d.x, T(0.0), T(0.0), d.y, T(0.0), d.z};
}

/// h dt/dw of the linearised laws in section axes: diag(h share a) - h curvature (a u) (a u)^T, and the drives'.
template <class T>
inline Sym3<T> gain_in_section(const Node<T>& node) {
  const Vec3<T>& a = node.law.gain;
  Sym3<T> G = diagonal(scaled(node.elastic ? a : times(node.linearized.share, a), node.h));
  if (!node.elastic) G += math::dyad(T(-(node.h * node.linearized.curvature)), times(a, node.linearized.u));
  if (node.driven) G += node.drive_gain;
  return G;
}

/// That of the elastic laws in world axes.
template <class T>
inline Sym3<T> gain_in_world(const Constants<T>& body, const Node<T>& node) {
  const Vec3<T> gain = scaled(node.law.gain, node.h);
  return math::select(body.anisotropic > T(0.0), congruent(node.axes, gain), diagonal(gain));
}

/// In the axes that each lane's joint is eliminated in.
template <class T>
inline Sym3<T> gain_of(const Constants<T>& body, const Node<T>& node) {
  if (!node.in_section) return gain_in_world(body, node);
  if (!node.mixed) return gain_in_section(node);
  return math::select(node.sectional > T(0.0), gain_in_section(node), gain_in_world(body, node));
}

/// Inertia and momentum target of a slot's bodies with all that hangs on them; their children's joints have been
/// eliminated.
template <class T>
inline Articulated<T> articulated_of(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot) {
  Articulated<T> sum = own_inertia(plan.constants[slot], nodes[slot]);
  if (nodes[slot].held) sum += nodes[slot].spring;
  add_children(plan, nodes, slot, sum);
  return sum;
}

/// The lanes whose joints are eliminated in section axes: 1, elsewhere 0.
template <class T>
inline T sectional_lanes(const Constants<T>& body, const Node<T>& node) {
  T lanes = body.sectional;
  if (!node.elastic) lanes = math::maximum(lanes, node.linearized.flowing);
  return node.driven ? math::maximum(lanes, node.drives) : lanes;
}

/// Eliminates a slot's joints from the leaves' side and passes the rest to their parents: in world axes, which turns
/// nothing but the gain, or, where laws differ much between the axes, in those of the section, where a locked axis
/// beside a loose one costs no digits.
template <class T>
inline void eliminate_joints(const Plan<T>& plan, std::vector<Node<T>>& nodes, int slot) {
  const Constants<T>& body = plan.constants[slot];
  Node<T>& node = nodes[slot];
  const Articulated<T> own = articulated_of(plan, nodes, slot);
  if (body.roots) node.root = own;
  Vec3<T> residual = scaled(linearized_torque(node, node.elastic_torque), -node.h);
  if (node.driven) residual += node.drive_residual;
  node.in_section = node.driven || !node.elastic || body.uneven;
  node.mixed = false;
  if (node.in_section) {
    node.sectional = sectional_lanes(body, node);
    node.mixed = !math::all(node.sectional > T(0.0));
  }
  const auto up = node.in_section  ? eliminate_in_section(own, gain_of(body, node), residual, node)
                  : body.isotropic ? eliminate(own, Isotropic<T>{node.h * node.law.gain.x}, node.axes * residual, node)
                                   : eliminate(own, gain_in_world(body, node), node.axes * residual, node);
  pass_to_parents(plan, slot, shifted(up, node.r), node);
}

template <class T>
inline void update_velocities(const Plan<T>& plan, std::vector<Node<T>>& nodes, int slot) {
  const Constants<T>& body = plan.constants[slot];
  Node<T>& node = nodes[slot];
  const auto [W, V] = velocities_of_parents(plan, nodes, slot);
  node.v_WB = V + cross(W, node.r);
  if (node.in_section && !node.mixed) {
    const Vec3<T> W_S = transposed_times(node.axes, W);
    const Vec3<T> w_S = node.y + node.P * W_S - node.B * node.v_WB;
    node.w_WB = motion_of(node) * w_S;
    node.w_PB = w_S - W_S;
  } else if (node.in_section) {
    const auto sectional = node.sectional > T(0.0);
    const Vec3<T> W_F = math::select(sectional, transposed_times(node.axes, W), W);
    const Vec3<T> w_F = node.y + node.P * W_F - node.B * node.v_WB;
    node.w_WB = math::select(sectional, motion_of(node) * w_F, w_F);
    node.w_PB = math::select(sectional, w_F - W_F, transposed_times(node.axes, w_F - W_F));
  } else {
    node.w_WB = node.y + node.P * W - node.B * node.v_WB;
    node.w_PB = transposed_times(node.axes, node.w_WB - W);
  }
  if (body.roots) update_roots(body, W, node);
  keep_velocities(plan, slot, node);
}

/// A slot's joints turn by no more than their slack.
template <class T>
inline bool within_limits(const Node<T>& node) {
  return math::all(node.h * node.h * dot(node.w_PB, node.w_PB) <= node.slack * node.slack);
}

/// Contacts or ties are there, or the velocities may lead some joint to its limits.
template <class T>
inline bool constraints_matter(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  if (!context.inputs->contacts.empty() || !context.inputs->ties.empty()) return true;
  if (plan.limited.empty()) return false;
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    if (plan.constants[slot].limited && !within_limits(nodes[slot])) return true;
  }
  return false;
}

template <class T>
inline void update_all_velocities(const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  for (int slot = 0; slot < plan.schedule.size(); ++slot) update_velocities(plan, nodes, slot);
}

/// The velocities may lead a joint of the copy to its limits.
template <class T>
inline bool nears_limit(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy) {
  const double h = context.copies[copy].h;
  return std::any_of(plan.limited.begin(), plan.limited.end(), [&](int body) {
    const Node<T>& node = nodes[plan.schedule.slot_of(copy, body)];
    const int lane = plan.schedule.lane_of(copy, body);
    const Vec3<double> w = math::lane_of(node.w_PB, lane);
    const double slack = math::lane(node.slack, lane);
    return !(h * h * dot(w, w) <= slack * slack);
  });
}

/// Makes the rows of the copies that have got constraints to solve for.
template <class T>
inline void find_constrained(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                             SolveReport& report) {
  if (!constraints_matter(context, plan, nodes)) return;
  const bool all = !context.inputs->contacts.empty() || !context.inputs->ties.empty();
  for (int k = 0; k < static_cast<int>(context.copies.size()); ++k) {
    Copy& copy = context.copies[k];
    if (copy.constrained || copy.settled || !(all || nears_limit(context, plan, nodes, k))) continue;
    report.constrained = copy.constrained = true;
    begin_constraints(context, plan, nodes, k);
  }
}

/// Velocities after the joints have been eliminated, with the constraints' impulses.
template <class T>
inline void find_velocities(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes,
                            SolveReport& report) {
  update_all_velocities(plan, nodes);
  find_constrained(context, plan, nodes, report);
  if (!report.constrained) return;
  renew_constraints(context);
  while (solve_constraints(context, plan, nodes)) update_all_velocities(plan, nodes);
}

/// The copies whose laws hold settle, in the last iteration all. Returns whether all have.
template <class T>
inline bool settle(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int iteration) {
  const bool last = iteration >= kMaxNewtonIterations;
  judge(context, plan, nodes, last ? kAcceptedTolerance : kNewtonTolerance);
  bool all = true;
  for (Copy& copy : context.copies) {
    if (!copy.settled && (copy.converged || last)) settle(copy, iteration);
    all = all && copy.settled;
  }
  return all;
}

/// Solves the step's convex problems, one of each copy: Newton's method on the joints' laws, an O(n) solve of the whole
/// tree each. What a copy comes to does not depend on which others step beside it.
template <class T>
inline SolveReport solve(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  SolveReport report;
  const int slots = plan.schedule.size();
  for (Copy& copy : context.copies) {
    copy.settled = copy.constrained = false;
    copy.fraction = 1.0;
  }
  while (true) {
    for (int slot = slots - 1; slot >= 0; --slot) eliminate_joints(plan, nodes, slot);
    find_velocities(context, plan, nodes, report);
    if (settle(context, plan, nodes, ++report.solves)) break;
    if (!improve(context, plan, nodes, report.solves)) break;
  }
  bool early = false;
  for (const Copy& copy : context.copies) {
    report.converged = report.converged && copy.converged;
    early = early || was_put_by(copy, report.solves);
  }
  if (early) take_out(context, plan, nodes, report.solves);
  return report;
}

template <class T>
inline SolveReport base_step_of(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  const int slots = plan.schedule.size();
  Node<T>& world = nodes[slots];
  world.orientation = {T(1.0), T(0.0), T(0.0), T(0.0)};
  world.w_WB = world.v_WB = Vec3<T>{};
  keep_orientations(plan, slots, world);
  keep_velocities(plan, slots, world);
  for (int slot = 0; slot < slots; ++slot) update_kinematics(context, plan, nodes, slot);
  begin_couplings(context, plan, nodes);
  begin_drives(context, plan, nodes);
  SolveReport report = solve(context, plan, nodes);
  commit_all(context, plan, nodes, report);
  return report;
}

}  // namespace layfigure::dynamics
