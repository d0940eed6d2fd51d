#pragma once

#include "base_step.h"

/// Ending a base step early on its way, without another solve.
namespace layfigure::dynamics {

template <class T>
inline double largest_turn_of(const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  T largest(0.0);
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    const Node<T>& node = nodes[slot];
    largest = math::maximum(largest, node.h * node.h * dot(node.w_WB, node.w_WB));
  }
  double most = 0.0;
  for (int k = 0; k < kLanes<T>; ++k) most = std::max(most, math::lane(largest, k));
  return std::sqrt(most);
}

template <class T>
inline SolveReport shorten_of(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes,
                              double part) {
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    Node<T>& node = nodes[slot];
    node.w_WB = scaled(node.w_WB, part);
    node.v_WB = scaled(node.v_WB, part);
    node.w_PB = scaled(node.w_PB, part);
    if (plan.constants[slot].flows) linearize(context.law, trial_torque(node, node.w_PB), node);
  }
  SolveReport report;
  for (const Copy& copy : context.copies) report.constrained = report.constrained || copy.constrained;
  commit_all(context, plan, nodes, report);
  return report;
}

}  // namespace layfigure::dynamics
