#pragma once

#include "articulated.h"
#include "lane_transfer.h"

/// Virtual couplings (step.h) in a base step: exact additions to the inertias and momenta of the bodies that they hold.
namespace layfigure::dynamics {

/// p_WBo of the body in one lane, summed along its path to the root.
template <class T>
inline Vec3<double> origin_of(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                              int copy, int body) {
  Vec3<double> origin{0.0, 0.0, 0.0};
  int slot = plan.schedule.slot_of(copy, body);
  int lane = plan.schedule.lane_of(copy, body);
  const Task* task = &plan.schedule.tasks(slot)[lane];
  while (task->parent_slot != plan.schedule.size()) {
    origin += math::lane_of(nodes[slot].r, lane);
    slot = task->parent_slot;
    lane = task->parent_lane;
    task = &plan.schedule.tasks(slot)[lane];
  }
  return origin + math::broadcast<double>(context.copies[copy].from[task->body].position);
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
  terms.angular_resistance = h * coupling.angular_stiffness + coupling.angular_damping;
  terms.angular_pull = scaled(target_spin, coupling.angular_damping);
  if (coupling.angular_stiffness == 0.0) return terms;
  const Quat<double> wanted =
      math::exp_rotation(scaled(target_spin, end)) * math::broadcast<double>(coupling.target_rotation);
  const Quat<double> frame = orientation * math::broadcast<double>(coupling.orientation);
  terms.angular_pull += scaled(math::log_rotation(wanted * conjugate(frame)), coupling.angular_stiffness);
  return terms;
}

/// Finds the couplings' terms and adds them to the bodies that they hold.
template <class T>
inline void begin_couplings(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  const auto couplings = context.inputs->couplings;
  for (int copy = 0; copy < static_cast<int>(context.copies.size()); ++copy) {
    const double h = context.copies[copy].h;
    for (std::size_t k = 0; k < couplings.size(); ++k) {
      CouplingTerms& terms = context.copies[copy].couplings[k];
      terms = coupling_terms(context, plan, nodes, copy, couplings[k]);
      Node<T>& node = nodes[plan.schedule.slot_of(copy, couplings[k].body)];
      if (!node.held) node.spring = {};
      node.held = true;
      add_lane(spring_terms(terms.r, h * terms.resistance, scaled(terms.pull, h), h * terms.angular_resistance,
                            scaled(terms.angular_pull, h)),
               node.spring, plan.schedule.lane_of(copy, couplings[k].body));
    }
  }
}

template <class T>
inline void measure_couplings(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  const auto couplings = context.inputs->couplings;
  for (int copy = 0; copy < static_cast<int>(context.copies.size()); ++copy) {
    Copy& run = context.copies[copy];
    for (std::size_t k = 0; k < couplings.size(); ++k) {
      const CouplingTerms& terms = run.couplings[k];
      const Node<T>& node = nodes[plan.schedule.slot_of(copy, couplings[k].body)];
      const int lane = plan.schedule.lane_of(copy, couplings[k].body);
      const Vec3<double> spin = math::lane_of(node.w_WB, lane);
      const Vec3<double> velocity = math::lane_of(node.v_WB, lane) + cross(spin, terms.r);
      const Vec3<double> force = terms.pull - scaled(velocity, terms.resistance);
      const Vec3<double> torque = terms.angular_pull - scaled(spin, terms.angular_resistance);
      run.coupling_forces[k] = {math::lane(force, 0), math::lane(torque, 0)};
      run.work.input += run.h * (dot(force, velocity) + dot(torque, spin));
    }
  }
}

}  // namespace layfigure::dynamics
