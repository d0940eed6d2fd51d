#pragma once

#include <array>
#include <cstddef>

#include "run.h"

/// Moving values between slots, whose lanes are different bodies, and between slots and the bodies' states.
namespace layfigure::dynamics {

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

/// Adds a value of one body in its lane.
template <class T, template <class> class Value>
inline void add_lane(const Value<double>& value, Value<T>& sum, int lane) {
  const double* from = numbers<double>(value);
  double* to = numbers<T>(sum) + lane;
  for (std::size_t j = 0; j < sizeof(Value<T>) / sizeof(T); ++j) to[j * kLanes<T>] += from[j];
}

// --- between slots ---------------------------------------------------------------------------------------------------

/// Row `row` of what each lane's parent keeps in rows. `nodes` has an entry per slot and the world's.
template <class T, class Entry, class Rows>
inline math::Quad<T> rows_of_parents(const Plan<T>& plan, const std::vector<Entry>& nodes, int slot, Rows Entry::*rows,
                                     int row = 0) {
  const Task* tasks = plan.schedule.tasks(slot);
  return math::gather<T>(
      [&](int k) { return (nodes[tasks[k].parent_slot].*rows).lanes[tasks[k].parent_lane].data() + 4 * row; });
}

/// Keeps numbers of a slot's bodies for slots that are not aligned to it.
template <class T, int kRows>
inline void keep_row(const math::Quad<T>& value, LaneRows<T, kRows>& rows, int row = 0) {
  math::scatter(value, [&](int k) { return rows.lanes[k].data() + 4 * row; });
}

template <class T>
inline void keep_orientations(const Plan<T>& plan, int slot, Node<T>& node) {
  if (!plan.schedule.read_by_lane(slot)) return;
  const Quat<T>& q = node.orientation;
  keep_row<T>({q.w, q.x, q.y, q.z}, node.orientation_rows);
}

template <class T>
inline void keep_velocities(const Plan<T>& plan, int slot, Node<T>& node) {
  if (!plan.schedule.read_by_lane(slot)) return;
  const Vec3<T>& w = node.w_WB;
  const Vec3<T>& v = node.v_WB;
  keep_row<T>({w.x, w.y, w.z, T(0.0)}, node.velocity_rows, 0);
  keep_row<T>({v.x, v.y, v.z, T(0.0)}, node.velocity_rows, 1);
}

template <class T>
inline Quat<T> orientations_of_parents(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot) {
  if (plan.schedule.aligned(slot)) return nodes[plan.schedule.parent_slot(slot)].orientation;
  const auto [w, x, y, z] = rows_of_parents(plan, nodes, slot, &Node<T>::orientation_rows);
  return {w, x, y, z};
}

template <class T>
struct Velocities {
  Vec3<T> w;
  Vec3<T> v;
};

template <class T>
inline Velocities<T> velocities_of_parents(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot) {
  if (plan.schedule.aligned(slot)) {
    const Node<T>& parent = nodes[plan.schedule.parent_slot(slot)];
    return {parent.w_WB, parent.v_WB};
  }
  const math::Quad<T> w = rows_of_parents(plan, nodes, slot, &Node<T>::velocity_rows, 0);
  const math::Quad<T> v = rows_of_parents(plan, nodes, slot, &Node<T>::velocity_rows, 1);
  return {{w.a, w.b, w.c}, {v.a, v.b, v.c}};
}

/// The numbers of an Articulated in rows of four, as `passed` keeps those of one lane. Written out, so that what is in
/// registers stays there.
template <class T>
inline std::array<math::Quad<T>, kArticulatedRows> rows_of(const Articulated<T>& a) {
  return {{{a.A.xx, a.A.xy, a.A.xz, a.A.yy},
           {a.A.yz, a.A.zz, a.H.xx, a.H.xy},
           {a.H.xz, a.H.yx, a.H.yy, a.H.yz},
           {a.H.zx, a.H.zy, a.H.zz, a.M.xx},
           {a.M.xy, a.M.xz, a.M.yy, a.M.yz},
           {a.M.zz, a.b_angular.x, a.b_angular.y, a.b_angular.z},
           {a.b_linear.x, a.b_linear.y, a.b_linear.z, T(0.0)}}};
}
template <class T>
inline Articulated<T> from_rows(const std::array<math::Quad<T>, kArticulatedRows>& r) {
  return {.A = {r[0].a, r[0].b, r[0].c, r[0].d, r[1].a, r[1].b},
          .H = {r[1].c, r[1].d, r[2].a, r[2].b, r[2].c, r[2].d, r[3].a, r[3].b, r[3].c},
          .M = {r[3].d, r[4].a, r[4].b, r[4].c, r[4].d, r[5].a},
          .b_angular = {r[5].b, r[5].c, r[5].d},
          .b_linear = {r[6].a, r[6].b, r[6].c}};
}

/// Keeps what a slot's bodies add to their parents.
template <class T>
inline void pass_to_parents(const Plan<T>& plan, int slot, const Articulated<T>& up, Node<T>& node) {
  if (plan.schedule.passed_whole(slot)) {
    node.passed_whole = up;
    return;
  }
  const auto rows = rows_of(up);
  for (int row = 0; row < kArticulatedRows; ++row) keep_row(rows[row], node.passed, row);
}

/// The sums of what the children of one lane's body have passed on.
template <class T>
inline void sum_children(const std::vector<Node<T>>& nodes, std::span<const int> children,
                         std::array<math::Lanes4, kArticulatedRows>& sums) {
  const auto row_of = [&](int place, int row) {
    return math::load(nodes[place / kLanes<T>].passed.lanes[place % kLanes<T>].data() + 4 * row);
  };
  if (children.empty()) {
    sums.fill(math::Lanes4(0.0));
    return;
  }
  for (int row = 0; row < kArticulatedRows; ++row) sums[row] = row_of(children[0], row);
  for (const int place : children.subspan(1)) {
    for (int row = 0; row < kArticulatedRows; ++row) sums[row] = sums[row] + row_of(place, row);
  }
}

/// Adds what the children have passed on, in tree order whatever the schedule.
template <class T>
inline void add_children(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot, Articulated<T>& own) {
  const Schedule& schedule = plan.schedule;
  if (schedule.adds_whole(slot)) {
    const std::span<const int> children = schedule.children(slot, schedule.busy_lane(slot));
    const auto passed_by = [&](int place) -> const Articulated<T>& { return nodes[place / kLanes<T>].passed_whole; };
    if (children.size() == 1) own += passed_by(children[0]);
    if (children.size() < 2) return;
    Articulated<T> sum = passed_by(children[0]);
    for (const int place : children.subspan(1)) sum += passed_by(place);
    own += sum;
    return;
  }
  std::array<std::array<math::Lanes4, kArticulatedRows>, kLanes<T>> sums;
  for (int k = 0; k < kLanes<T>; ++k) sum_children(nodes, schedule.children(slot, k), sums[k]);
  std::array<math::Quad<T>, kArticulatedRows> rows;
  for (int row = 0; row < kArticulatedRows; ++row) {
    rows[row] = math::gather<T>([&](int k) { return math::numbers(sums[k][row]); });
  }
  own += from_rows(rows);
}

// --- the bodies' states ----------------------------------------------------------------------------------------------

// Steps read and write each vector with the number behind it.
static_assert(offsetof(BodyState, flow) == offsetof(BodyState, linear_momentum) + 3 * sizeof(double));
static_assert(offsetof(BodyState, yield_scale) == offsetof(BodyState, angular_momentum) + 3 * sizeof(double));
static_assert(offsetof(BodyState, limit_slack) == offsetof(BodyState, trial_torque) + 3 * sizeof(double));
static_assert(offsetof(BodyState, rest_time) == offsetof(BodyState, torque) + 3 * sizeof(double));

/// Four numbers of each lane's body; state(k) is that of lane k.
template <class T, class State>
inline math::Quad<T> gather_numbers(const State& state, Eigen::Vector3d BodyState::*vector) {
  return math::gather<T>([&](int k) { return (state(k)->*vector).data(); });
}
template <class T, class State>
inline Quat<T> gather_rotations(const State& state, Eigen::Quaterniond BodyState::*rotation) {
  const math::Quad<T> q = math::gather<T>([&](int k) { return (state(k)->*rotation).coeffs().data(); });
  return {q.d, q.a, q.b, q.c};
}

template <class T, class State>
inline Bodies<T> gather_bodies(const State& state) {
  const math::Quad<T> linear = gather_numbers<T>(state, &BodyState::linear_momentum);
  const math::Quad<T> angular = gather_numbers<T>(state, &BodyState::angular_momentum);
  const math::Quad<T> trial = gather_numbers<T>(state, &BodyState::trial_torque);
  return {.rotation = gather_rotations<T>(state, &BodyState::rotation),
          .rest = gather_rotations<T>(state, &BodyState::rest_rotation),
          .linear_momentum = {linear.a, linear.b, linear.c},
          .angular_momentum = {angular.a, angular.b, angular.c},
          .trial_torque = {trial.a, trial.b, trial.c},
          .flow = linear.d,
          .yield_scale = angular.d,
          .limit_slack = trial.d};
}

template <class T>
inline Bodies<T> read_bodies(const StepContext& context, const Plan<T>& plan, int slot) {
  const Task* tasks = plan.schedule.tasks(slot);
  std::array<const BodyState*, kLanes<T>> states;
  for (int k = 0; k < kLanes<T>; ++k) {
    states[k] = context.copies[tasks[k].copy].from + tasks[k].body;
  }
  return gather_bodies<T>([&](int k) { return states[k]; });
}

template <class T, class State>
inline void scatter_numbers(const Vec3<T>& three, const T& fourth, const State& state,
                            Eigen::Vector3d BodyState::*vector) {
  math::scatter<T>({three.x, three.y, three.z, fourth}, [&](int k) { return (state(k)->*vector).data(); });
}
template <class T, class State>
inline void scatter_rotations(const Quat<T>& q, const State& state, Eigen::Quaterniond BodyState::*rotation) {
  math::scatter<T>({q.x, q.y, q.z, q.w}, [&](int k) { return (state(k)->*rotation).coeffs().data(); });
}

/// The positions of bodies that are no roots never change.
template <class T>
inline void move_roots(const StepContext& context, const Plan<T>& plan, int slot, const Node<T>& node) {
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.idle || task.parent_slot != plan.schedule.size()) continue;
    const Copy& copy = context.copies[task.copy];
    copy.to[task.body].position = copy.from[task.body].position + copy.h * lane(node.v_WB, k);
  }
}

template <class T>
inline void write_bodies(const StepContext& context, const Plan<T>& plan, int slot, const Node<T>& node,
                         const Bodies<T>& bodies, const Vec3<T>& torque) {
  const Task* tasks = plan.schedule.tasks(slot);
  BodyState unread;
  std::array<BodyState*, kLanes<T>> states;
  for (int k = 0; k < kLanes<T>; ++k) {
    states[k] = tasks[k].idle ? &unread : context.copies[tasks[k].copy].to + tasks[k].body;
  }
  const auto state = [&](int k) { return states[k]; };
  scatter_rotations(bodies.rotation, state, &BodyState::rotation);
  scatter_rotations(bodies.rest, state, &BodyState::rest_rotation);
  scatter_numbers(bodies.linear_momentum, bodies.flow, state, &BodyState::linear_momentum);
  scatter_numbers(bodies.angular_momentum, bodies.yield_scale, state, &BodyState::angular_momentum);
  scatter_numbers(bodies.trial_torque, bodies.limit_slack, state, &BodyState::trial_torque);
  // Whoever lets bodies sleep counts their rest (sleepers.h).
  scatter_numbers(torque, T(0.0), state, &BodyState::torque);
  for (int k = 0; k < kLanes<T>; ++k) {
    states[k]->yielding = !node.elastic && math::lane(node.linearized.flowing, k) > 0.0;
    states[k]->asleep = false;
  }
  if (plan.constants[slot].based) move_roots(context, plan, slot, node);
}

}  // namespace layfigure::dynamics
