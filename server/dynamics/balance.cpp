#include "balance.h"

#include "axis_law.h"
#include "drives.h"
#include "lane_transfer.h"
#include "layfigure/math/kernel.h"

namespace layfigure::dynamics {
namespace {

// A tenth of what Energy::rounding allows for two energies, so that a step that is measured to be in balance here is so
// by any other order of summation as well.
constexpr double kRounding = 0.1 * kEnergyRounding;
constexpr double kStrainRounding = 0.1 * kAngleRounding;

template <class T>
struct Sums {
  T gained{0.0};
  T kinetic{0.0};
  T turning{0.0};
  T scale{0.0};   ///< sizes of the parts
  T torque{0.0};  ///< of the springs
};

template <class T>
inline T absolute(const T& x) {
  return math::maximum(x, -x);
}

/// The state of the body in each lane after the step.
template <class T>
inline Bodies<T> read_moved_bodies(const StepContext& context, const Plan<T>& plan, int slot) {
  const BodyState* to = context.copies[0].to;
  const Task* tasks = plan.schedule.tasks(slot);
  return gather_bodies<T>([&](int k) { return to + tasks[k].body; });
}

/// How far the roots of a slot went.
template <class T>
inline Vec3<T> root_shift(const StepContext& context, const Plan<T>& plan, int slot) {
  const Copy& copy = context.copies[0];
  const auto shift = [&](int k, int axis) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.idle || task.parent_slot != plan.schedule.size()) return 0.0;
    return copy.to[task.body].position[axis] - copy.from[task.body].position[axis];
  };
  return {math::from_lanes<T>([&](int k) { return shift(k, 0); }),
          math::from_lanes<T>([&](int k) { return shift(k, 1); }),
          math::from_lanes<T>([&](int k) { return shift(k, 2); })};
}

template <class T>
inline T rotational_energy(const EnergyConstants<T>& body, const Quat<T>& orientation, const Vec3<T>& momentum) {
  const Vec3<T> along = rotate(conjugate(orientation * body.principal), momentum);
  return T(0.5) * dot(times(along, along), body.inverse_moments);
}

template <class T>
struct Moves {
  Quat<T> orientation;
  Vec3<T> shift;
};

template <class T>
inline void keep_moves(const Plan<T>& plan, int slot, Moved<T>& moved) {
  if (!plan.schedule.read_by_lane(slot)) return;
  const Quat<T>& q = moved.orientation;
  keep_row<T>({q.w, q.x, q.y, q.z}, moved.rows, 0);
  keep_row<T>({moved.shift.x, moved.shift.y, moved.shift.z, T(0.0)}, moved.rows, 1);
}

template <class T>
inline Moves<T> moves_of_parents(const Plan<T>& plan, const std::vector<Moved<T>>& all, int slot) {
  if (plan.schedule.aligned(slot)) {
    const Moved<T>& parent = all[plan.schedule.parent_slot(slot)];
    return {parent.orientation, parent.shift};
  }
  const auto [w, x, y, z] = rows_of_parents(plan, all, slot, &Moved<T>::rows, 0);
  const math::Quad<T> shift = rows_of_parents(plan, all, slot, &Moved<T>::rows, 1);
  return {{w, x, y, z}, {shift.a, shift.b, shift.c}};
}

/// Poses after the step; returns how far the coms went.
template <class T>
inline Vec3<T> move(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int slot,
                    const Bodies<T>& after, std::vector<Moved<T>>& all) {
  const Constants<T>& body = plan.constants[slot];
  Moved<T>& moved = all[slot];
  const auto [parent, parent_shift] = moves_of_parents(plan, all, slot);
  moved.orientation = renormalized((body.mounted ? parent * body.mount : parent) * after.rotation);
  moved.shift = parent_shift + (rotate(parent, body.anchor) - nodes[slot].r);
  if (body.roots) moved.shift += root_shift(context, plan, slot);
  keep_moves(plan, slot, moved);
  return moved.shift + (rotate(moved.orientation, body.com) - nodes[slot].c);
}

template <class T>
inline void add_kinetic(const EnergyConstants<T>& body, const Node<T>& node, const Bodies<T>& before,
                        const Bodies<T>& after, Moved<T>& moved, Sums<T>& sums) {
  const T half_over_mass = T(0.5) * body.inverse_mass;
  const T linear_before = half_over_mass * dot(before.linear_momentum, before.linear_momentum);
  const T linear = half_over_mass * dot(after.linear_momentum, after.linear_momentum);
  const T spin_before = rotational_energy(body, node.orientation, before.angular_momentum);
  moved.spin = rotational_energy(body, moved.orientation, after.angular_momentum);
  moved.turning = moved.spin - rotational_energy(body, node.orientation, after.angular_momentum);
  const auto active = body.active > T(0.0);
  const T zero(0.0);
  sums.gained = sums.gained + math::select(active, (linear - linear_before) + (moved.spin - spin_before), zero);
  sums.kinetic = sums.kinetic + math::select(active, linear + moved.spin, zero);
  sums.turning = sums.turning + math::select(active, math::maximum(moved.turning, zero), zero);
  sums.scale = sums.scale + math::select(active, linear_before + spin_before, zero);
}

template <class T>
inline void add_elastic(const Constants<T>& body, const EnergyConstants<T>& energy, const Node<T>& node,
                        const Bodies<T>& after, Sums<T>& sums) {
  Vec3<T> strain = log_rotation(conjugate(after.rest) * after.rotation);
  if (!body.isotropic) {
    strain = math::select(body.anisotropic > T(0.0), rotate(conjugate(body.section), strain), strain);
  }
  const Vec3<T> torque = times(body.stiffness, strain);
  const Vec3<T>& t = node.elastic_torque;
  const T elastic = T(0.5) * dot(torque, strain);
  const T elastic_before = T(0.5) * dot(times(t, t), energy.compliance);
  const auto active = energy.active > T(0.0);
  const T zero(0.0);
  sums.gained = sums.gained + math::select(active, elastic - elastic_before, zero);
  sums.scale = sums.scale + math::select(active, elastic + elastic_before, zero);
  const Vec3<T>& K = body.stiffness;
  const T size = absolute(torque.x) + absolute(t.x) + absolute(torque.y) + absolute(t.y) + absolute(torque.z) +
                 absolute(t.z) + kAngleRounding * (K.x + K.y + K.z);
  sums.torque = sums.torque + math::select(active, size, zero);
}

template <class T>
inline void add_gravity(const StepContext& context, const Constants<T>& body, const EnergyConstants<T>& energy,
                        const Vec3<T>& shift, Sums<T>& sums) {
  const Vec3<double>& g = context.gravity;
  const T work = body.mass * (shift.x * g.x + shift.y * g.y + shift.z * g.z);
  const auto active = energy.active > T(0.0);
  sums.gained = sums.gained - math::select(active, work, T(0.0));
  sums.scale = sums.scale + math::select(active, absolute(work), T(0.0));
}

/// The work of a torque is its angular impulse times the angular velocity; that of a force goes with the way, which is
/// known to a part of `reach`.
inline void add_work(const Copy& copy, const BodyForce& load, const Eigen::Vector3d& way, double reach,
                     const Eigen::Vector3d& spin, Balance& balance) {
  const double angular = copy.h * load.torque.dot(spin);
  balance.input += load.force.dot(way) + angular;
  balance.input_rounding += kRounding * (load.force.norm() * (reach + way.norm()) + std::abs(angular));
}

template <class T>
inline void add_loads(const StepContext& context, const Plan<T>& plan, const Node<T>& node, int slot,
                      const Vec3<T>& shift, const std::vector<double>& reach, Balance& balance) {
  const Copy& copy = context.copies[0];
  for (int k = 0; k < kLanes<T>; ++k) {
    const Task& task = plan.schedule.tasks(slot)[k];
    if (task.idle) continue;
    add_work(copy, copy.loads[task.body], lane(shift, k), reach[task.body], lane(node.w_WB, k), balance);
  }
}

/// A coupling's spring does the work of its mean force along the way, which is what it loses. Its force at the end,
/// had the held point moved straight on with its velocity v, is known:  mean = end + K (h v - (h v_target + way) / 2).
template <class T>
inline void add_couplings(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                          const BalanceRecords<T>& records, Balance& balance) {
  const Copy& copy = context.copies[0];
  for (std::size_t k = 0; k < context.inputs->couplings.size(); ++k) {
    const Coupling& coupling = context.inputs->couplings[k];
    const int slot = plan.schedule.slot_of(0, coupling.body);
    const int index = plan.schedule.lane_of(0, coupling.body);
    const Node<T>& node = nodes[slot];
    const Eigen::Vector3d r = lane(node.orientation, index) * coupling.point;
    const Moved<T>& moved = records.moved[slot];
    const Eigen::Vector3d way = lane(moved.shift, index) + (lane(moved.orientation, index) * coupling.point - r);
    const Eigen::Vector3d spin = lane(node.w_WB, index);
    const Eigen::Vector3d ahead = copy.h * (lane(node.v_WB, index) + spin.cross(r));
    BodyForce mean = copy.coupling_forces[k];
    mean.force += coupling.stiffness * (ahead - 0.5 * (copy.h * coupling.target_velocity + way));
    mean.torque += 0.5 * coupling.angular_stiffness * copy.h * (spin - coupling.target_angular_velocity);
    add_work(copy, mean, way, records.reach[coupling.body] + r.norm(), spin, balance);
  }
}

/// A drive's torque goes with the turn of its joint, about an axis that turns with neither body. A stiff one's is a
/// small difference of what its resistance makes of large velocities.
template <class T>
inline void add_drives(const StepContext& context, const std::vector<Node<T>>& nodes, Balance& balance) {
  const Copy& copy = context.copies[0];
  for (std::size_t k = 0; k < copy.drives.size(); ++k) {
    const DriveTerms& drive = copy.drives[k];
    const Eigen::Vector3d w = math::lane(relative_velocity(drive, nodes), 0);
    const double spin = lane(nodes[drive.slot].w_WB, drive.lane).norm();
    const double noise = copy.drive_torques[k].norm() + drive.share * drive.resistance * spin;
    balance.input += copy.h * copy.drive_torques[k].dot(w);
    balance.input_rounding += kRounding * copy.h * noise * w.norm();
  }
}

template <class T>
inline Balance measure(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                       BalanceRecords<T>& records) {
  const int slots = plan.schedule.size();
  records.moved[slots].orientation = {T(1.0), T(0.0), T(0.0), T(0.0)};
  records.moved[slots].shift = Vec3<T>{};
  keep_moves(plan, slots, records.moved[slots]);
  Sums<T> sums;
  Balance balance;
  for (int slot = 0; slot < slots; ++slot) {
    const EnergyConstants<T>& energy = records.constants[slot];
    const Bodies<T> before = read_bodies(context, plan, slot);
    const Bodies<T> after = read_moved_bodies(context, plan, slot);
    const Vec3<T> shift = move(context, plan, nodes, slot, after, records.moved);
    add_kinetic(energy, nodes[slot], before, after, records.moved[slot], sums);
    add_elastic(plan.constants[slot], energy, nodes[slot], after, sums);
    add_gravity(context, plan.constants[slot], energy, shift, sums);
    if (context.inputs->loads != nullptr) add_loads(context, plan, nodes[slot], slot, shift, records.reach, balance);
  }
  add_couplings(context, plan, nodes, records, balance);
  add_drives(context, nodes, balance);
  balance.gained = math::total(sums.gained);
  balance.kinetic = math::total(sums.kinetic);
  balance.turning = math::total(sums.turning);
  const double weights = records.weight_reach * std::sqrt(dot(context.gravity, context.gravity));
  balance.rounding +=
      kRounding * (math::total(sums.scale) + balance.kinetic + weights) + kStrainRounding * math::total(sums.torque);
  return balance;
}

/// The greatest distances of the groups' coms from their roots' origins; of their joints first.
template <class T>
void set_reaches(const Model& model, const RigidGroups& groups, BalanceRecords<T>& records) {
  records.reach.resize(model.size());
  records.weight_reach = 0.0;
  for (const int i : groups.carriers()) {
    const RigidGroup& group = groups.group(i);
    records.reach[i] = group.parent < 0 ? 0.0 : records.reach[group.parent] + group.anchor.norm();
  }
  for (const int i : groups.carriers()) {
    records.reach[i] += groups.group(i).com.norm();
    records.weight_reach += groups.group(i).mass * records.reach[i];
  }
}

template <class T>
void set_body(const RigidGroup& group, const JointLaw& law, int k, EnergyConstants<T>& constants) {
  const Eigen::Vector3d stiffness = axis_stiffness(law);
  set_lane(constants.principal, k, Eigen::Quaterniond(group.inertia.axes));
  set_lane(constants.inverse_moments, k, group.inertia.moments.cwiseInverse());
  for (int axis = 0; axis < 3; ++axis) {
    const double compliance = stiffness[axis] > 0.0 ? 1.0 / stiffness[axis] : 0.0;
    math::set_lane(axis == 0   ? constants.compliance.x
                   : axis == 1 ? constants.compliance.y
                               : constants.compliance.z,
                   k, compliance);
  }
  math::set_lane(constants.inverse_mass, k, 1.0 / group.mass);
}

}  // namespace

template <class T>
void set_records(const Model& model, const RigidGroups& groups, const Schedule& schedule, BalanceRecords<T>& records) {
  records.constants.resize(schedule.size());
  records.moved.resize(schedule.size() + 1);
  set_reaches(model, groups, records);
  for (int slot = 0; slot < schedule.size(); ++slot) {
    for (int k = 0; k < schedule.lanes(); ++k) {
      const Task& task = schedule.tasks(slot)[k];
      set_body(task.idle ? idle_group() : groups.group(task.body), task.idle ? JointLaw{} : model.body(task.body).joint,
               k, records.constants[slot]);
      math::set_lane(records.constants[slot].active, k, task.idle ? 0.0 : 1.0);
    }
  }
}
template void set_records(const Model&, const RigidGroups&, const Schedule&, BalanceRecords<double>&);
template void set_records(const Model&, const RigidGroups&, const Schedule&, BalanceRecords<math::Lanes4>&);

LAYFIGURE_KERNEL
Balance measure_balance(const StepContext& context, const Plan<double>& plan, const std::vector<Node<double>>& nodes,
                        BalanceRecords<double>& records) {
  return measure(context, plan, nodes, records);
}

LAYFIGURE_KERNEL
Balance measure_balance(const StepContext& context, const Plan<math::Lanes4>& plan,
                        const std::vector<Node<math::Lanes4>>& nodes, BalanceRecords<math::Lanes4>& records) {
  return measure(context, plan, nodes, records);
}

}  // namespace layfigure::dynamics
