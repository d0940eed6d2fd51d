#pragma once

#include <array>

#include "run.h"

/// Moving values between slots, whose lanes are different bodies, and between slots and the bodies' states.
namespace layfigure::dynamics {

template <class T>
constexpr int kLanes = math::LaneTraits<T>::kCount;

/// A value made of scalars T as an array of doubles: number j of lane k is at [j lanes + k].
template <class T, class Value>
inline double* numbers(Value& value) {
  static_assert(sizeof(Value) % sizeof(T) == 0);
  return reinterpret_cast<double*>(&value);
}
template <class T, class Value>
inline const double* numbers(const Value& value) {
  return reinterpret_cast<const double*>(&value);
}

template <class T>
inline Eigen::Matrix3d lane_matrix(const Mat3<T>& m, int k) {
  const auto at = [k](const T& value) { return math::lane(value, k); };
  Eigen::Matrix3d matrix;
  matrix << at(m.xx), at(m.xy), at(m.xz), at(m.yx), at(m.yy), at(m.yz), at(m.zx), at(m.zy), at(m.zz);
  return matrix;
}
template <class T>
inline Eigen::Matrix3d lane_matrix(const Sym3<T>& m, int k) {
  return lane_matrix(math::full(m), k);
}

/// The member of each lane's parent; the world's where it has none. `nodes` has an entry per slot and the world's.
template <class T, class Entry, class Value>
inline Value of_parents(const Plan<T>& plan, const std::vector<Entry>& nodes, int slot, Value Entry::*member) {
  const Schedule& schedule = plan.schedule;
  if (schedule.aligned(slot)) return nodes[schedule.parent_slot(slot)].*member;
  const Task* tasks = schedule.tasks(slot);
  const auto parent_number = [&](int k, std::size_t j) {
    return numbers<T>(nodes[tasks[k].parent_slot].*member)[j * kLanes<T> + tasks[k].parent_lane];
  };
  Value value;
  T* const to = reinterpret_cast<T*>(&value);
  for (std::size_t j = 0; j < sizeof(Value) / sizeof(T); ++j) {
    to[j] = math::from_lanes<T>([&](int k) { return parent_number(k, j); });
  }
  return value;
}

/// Adds each lane's value to a sum of its copy.
template <class T>
inline void add_work(const StepContext& context, const Plan<T>& plan, int slot, double Work::*sum, const T& value) {
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.copy >= 0) context.copies[task.copy].work.*sum += math::lane(value, k);
  }
}

/// Adds one lane's share of a child's articulated inertia to its parent's.
template <class T>
inline void add_lane(const Articulated<T>& child, int child_lane, Articulated<T>& parent, int parent_lane) {
  const double* from = numbers<T>(child) + child_lane;
  double* to = numbers<T>(parent) + parent_lane;
  for (std::size_t j = 0; j < sizeof(Articulated<T>) / sizeof(T); ++j) to[j * kLanes<T>] += from[j * kLanes<T>];
}

/// Adds a value of one body in its lane.
template <class T, template <class> class Value>
inline void add_lane(const Value<double>& value, Value<T>& sum, int lane) {
  const double* from = numbers<double>(value);
  double* to = numbers<T>(sum) + lane;
  for (std::size_t j = 0; j < sizeof(Value<T>) / sizeof(T); ++j) to[j * kLanes<T>] += from[j];
}

template <class T>
inline void add_to_parents(const Plan<T>& plan, std::vector<Node<T>>& nodes, int slot, const Articulated<T>& child) {
  const Schedule& schedule = plan.schedule;
  const int world = schedule.size();
  if (schedule.aligned(slot)) {
    if (schedule.parent_slot(slot) != world) nodes[schedule.parent_slot(slot)].articulated += child;
    return;
  }
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = schedule.tasks(slot)[k];
    if (task.parent_slot != world) add_lane(child, k, nodes[task.parent_slot].articulated, task.parent_lane);
  }
}

/// The state of the body in each lane before the step; an idle lane reads some body's.
template <class T>
struct Bodies {
  Quat<T> rotation;
  Quat<T> rest;
  Vec3<T> linear_momentum;
  Vec3<T> angular_momentum;
  Vec3<T> trial_torque;
  T flow;
  T yield_scale;
  T limit_slack{};
};

inline const BodyState& state_of(const StepContext& context, const Task& task) {
  return task.copy < 0 ? context.copies[0].from[0] : context.copies[task.copy].from[task.body];
}

/// The bodies state(0), state(1), .. , one per lane.
template <class T, class F>
inline Bodies<T> gather_bodies(const F& state) {
  std::array<const BodyState*, kLanes<T>> states;
  for (int k = 0; k < kLanes<T>; ++k) states[k] = state(k);
  return {math::quaternion_from_lanes<T>([&](int k) -> auto& { return states[k]->rotation; }),
          math::quaternion_from_lanes<T>([&](int k) -> auto& { return states[k]->rest_rotation; }),
          math::vector_from_lanes<T>([&](int k) -> auto& { return states[k]->linear_momentum; }),
          math::vector_from_lanes<T>([&](int k) -> auto& { return states[k]->angular_momentum; }),
          math::vector_from_lanes<T>([&](int k) -> auto& { return states[k]->trial_torque; }),
          math::from_lanes<T>([&](int k) { return states[k]->flow; }),
          math::from_lanes<T>([&](int k) { return states[k]->yield_scale; })};
}

template <class T>
inline Bodies<T> read_bodies(const StepContext& context, const Plan<T>& plan, int slot) {
  const Task* tasks = plan.schedule.tasks(slot);
  return gather_bodies<T>([&](int k) { return &state_of(context, tasks[k]); });
}

template <class T>
inline void write_bodies(const StepContext& context, const Plan<T>& plan, int slot, const Node<T>& node,
                         const Bodies<T>& bodies, const Vec3<T>& torque) {
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.copy < 0) continue;
    const Copy& copy = context.copies[task.copy];
    BodyState& state = copy.to[task.body];
    const Eigen::Vector3d& position = copy.from[task.body].position;
    const bool root = task.parent_slot == plan.schedule.size();
    state.position = root ? (position + copy.h * lane(node.v_WB, k)).eval() : position;
    state.rotation = lane(bodies.rotation, k);
    state.rest_rotation = lane(bodies.rest, k);
    state.linear_momentum = lane(bodies.linear_momentum, k);
    state.angular_momentum = lane(bodies.angular_momentum, k);
    state.torque = lane(torque, k);
    state.trial_torque = lane(bodies.trial_torque, k);
    state.flow = math::lane(bodies.flow, k);
    state.yield_scale = math::lane(bodies.yield_scale, k);
    state.yielding = math::lane(node.linearized.flowing, k) > 0.0;
    state.limit_slack = math::lane(bodies.limit_slack, k);
    state.rest_time = copy.from[task.body].rest_time;
    state.asleep = false;
  }
}

}  // namespace layfigure::dynamics
