#pragma once

#include <algorithm>
#include <cmath>

#include "lane_transfer.h"
#include "run.h"

/// Drives (step.h) in the base step: one more law at their joints, a spring and damper whose torque is shortened to its
/// largest length. The shortening is the projection onto a ball, the gradient of a convex function, so Newton's method
/// on the joints' laws (newton.h) includes it. Few joints are driven or few laws bounded: lane by lane.
namespace layfigure::dynamics {

inline Vec3<double> trial_torque(const DriveTerms& drive, const Vec3<double>& w) {
  return scaled(w, drive.resistance) - drive.pull;
}

/// Part of the trial torque s that is exerted.
inline double exerted_share(const DriveTerms& drive, const Vec3<double>& s) {
  const double size = std::sqrt(dot(s, s));
  if (size < drive.max_torque) return 1.0;
  return size == 0.0 ? 0.0 : drive.max_torque / size;
}

inline Vec3<double> drive_torque(const DriveTerms& drive, const Vec3<double>& s) {
  return scaled(s, exerted_share(drive, s));
}

inline Vec3<double> linearized_torque(const DriveTerms& drive, const Vec3<double>& s) {
  const double along = dot(drive.direction, s - drive.trial);
  return scaled(s - scaled(drive.direction, along), drive.share);
}

inline void linearize(const Vec3<double>& trial, DriveTerms& drive) {
  const double size = std::sqrt(dot(trial, trial));
  drive.trial = trial;
  drive.share = exerted_share(drive, trial);
  drive.direction = size < drive.max_torque || size == 0.0 ? Vec3<double>{} : scaled(trial, 1.0 / size);
}

/// Relative angular velocity of the driven joint.
template <class T>
inline Vec3<double> relative_velocity(const DriveTerms& drive, const std::vector<Node<T>>& nodes) {
  const Node<T>& node = nodes[drive.slot];
  return math::lane_of(motion_of(node), drive.lane) * math::lane_of(node.w_PB, drive.lane);
}

/// The drive over one sub-step, linearised as if the joint kept up with its target.
template <class T>
inline DriveTerms drive_terms(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                              int copy, const Drive& drive) {
  DriveTerms terms;
  terms.slot = plan.schedule.slot_of(copy, drive.body);
  terms.lane = plan.schedule.lane_of(copy, drive.body);
  const Constants<T>& constants = plan.constants[terms.slot];
  const bool jointed = math::lane(constants.free + constants.fixed, terms.lane) == 0.0;
  const double K = jointed ? std::min(drive.stiffness, kRigidStiffness) : 0.0;
  const double B = jointed ? drive.damping : 0.0;
  const Copy& run = context.copies[copy];
  const Task& task = plan.schedule.tasks(terms.slot)[terms.lane];
  const Quat<double> parent =
      math::lane_of(nodes[task.parent_slot].orientation, task.parent_lane) * math::lane_of(constants.mount, terms.lane);
  const auto target_velocity = math::broadcast<double>(drive.target_velocity);
  const Quat<double> wanted =
      math::exp_rotation(scaled(target_velocity, run.offset + run.h)) * math::broadcast<double>(drive.target_rotation);
  const auto rotation = math::broadcast<double>(run.from[drive.body].rotation);
  const Vec3<double> error = math::log_rotation(wanted * conjugate(rotation));
  terms.resistance = run.h * K + B;
  terms.pull = rotate(parent, scaled(error, K) + scaled(target_velocity, B));
  terms.max_torque = drive.max_torque;
  linearize(trial_torque(terms, rotate(parent, target_velocity)), terms);
  return terms;
}

/// What the linearised drive adds to its joint's gain and residual, in section axes.
template <class T>
inline void add_to_joint(const DriveTerms& drive, double h, Node<T>& node) {
  const Mat3<double> motion = math::lane_of(motion_of(node), drive.lane);
  const double k = h * drive.resistance * drive.share;
  Sym3<double> gain = math::dyad(-k, drive.direction);
  gain += Sym3<double>{k, 0.0, 0.0, k, 0.0, k};
  const Vec3<double> torque = linearized_torque(drive, trial_torque(drive, Vec3<double>{}));
  math::set_lane(node.drives, drive.lane, 1.0);
  add_lane(congruent(transposed(motion), gain), node.drive_gain, drive.lane);
  add_lane(transposed_times(motion, scaled(torque, -h)), node.drive_residual, drive.lane);
}

template <class T>
inline void add_to_joints(const StepContext& context, std::vector<Node<T>>& nodes) {
  for (const Copy& copy : context.copies) {
    for (const DriveTerms& drive : copy.drives) {
      Node<T>& node = nodes[drive.slot];
      node.driven = true;
      node.drives = T(0.0);
      node.drive_gain = {};
      node.drive_residual = {};
    }
  }
  for (const Copy& copy : context.copies) {
    for (const DriveTerms& drive : copy.drives) add_to_joint(drive, copy.h, nodes[drive.slot]);
  }
}

template <class T>
inline void begin_drives(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes) {
  const auto drives = context.inputs->drives;
  for (int copy = 0; copy < static_cast<int>(context.copies.size()); ++copy) {
    for (std::size_t k = 0; k < drives.size(); ++k) {
      context.copies[copy].drives[k] = drive_terms(context, plan, nodes, copy, drives[k]);
    }
  }
  add_to_joints(context, nodes);
}

/// Every drive of a copy agrees with its linearisation to a part `tolerance` of its torque, and `rounding` of what its
/// resistance makes of its body's own velocity.
template <class T>
inline bool drives_hold(const Copy& copy, const std::vector<Node<T>>& nodes, double tolerance, double rounding) {
  for (const DriveTerms& drive : copy.drives) {
    const Vec3<double> s = trial_torque(drive, relative_velocity(drive, nodes));
    const Vec3<double> torque = drive_torque(drive, s);
    const Vec3<double> error = torque - linearized_torque(drive, s);
    const Vec3<double> spin = scaled(math::lane_of(nodes[drive.slot].w_WB, drive.lane), drive.resistance);
    const double tolerated = tolerance * tolerance * dot(torque, torque) + rounding * rounding * dot(spin, spin);
    if (!(dot(error, error) <= tolerated)) return false;
  }
  return true;
}

/// The part of a copy's drives in the slope in newton.h.
template <class T>
inline double drive_slope(const Copy& copy, const std::vector<Node<T>>& nodes) {
  double sum = 0.0;
  for (const DriveTerms& drive : copy.drives) {
    const Vec3<double> w_new = relative_velocity(drive, nodes);
    const Vec3<double> d = w_new - drive.iterate;
    const Vec3<double> affine_new = scaled(linearized_torque(drive, trial_torque(drive, w_new)), -copy.h);
    const Vec3<double> affine = drive.affine + scaled(affine_new - drive.affine, copy.fraction);
    const Vec3<double> w = drive.iterate + scaled(d, copy.fraction);
    sum += dot(affine + scaled(drive_torque(drive, trial_torque(drive, w)), copy.h), d);
  }
  return sum;
}

/// Linearises the drives of copies that go on at these' fractions of the way to the new solution.
template <class T>
inline void accept_drives(const StepContext& context, std::vector<Node<T>>& nodes, bool first) {
  for (Copy& copy : context.copies) {
    if (copy.settled) continue;
    const double lambda = copy.fraction;
    for (DriveTerms& drive : copy.drives) {
      const Vec3<double> w = relative_velocity(drive, nodes);
      const Vec3<double> affine = scaled(linearized_torque(drive, trial_torque(drive, w)), -copy.h);
      drive.affine = first ? affine : drive.affine + scaled(affine - drive.affine, lambda);
      drive.iterate = first ? w : drive.iterate + scaled(w - drive.iterate, lambda);
      linearize(trial_torque(drive, drive.iterate), drive);
    }
  }
  add_to_joints(context, nodes);
}

/// Torques on the children and their work, at the final velocities.
template <class T>
inline void measure_drives(const StepContext& context, const std::vector<Node<T>>& nodes) {
  for (Copy& copy : context.copies) {
    for (std::size_t k = 0; k < copy.drives.size(); ++k) {
      const DriveTerms& drive = copy.drives[k];
      const Vec3<double> w = relative_velocity(drive, nodes);
      const Vec3<double> torque = drive_torque(drive, trial_torque(drive, w));
      copy.drive_torques[k] = -math::lane(torque, 0);
      copy.work.input -= copy.h * dot(torque, w);
    }
  }
}

}  // namespace layfigure::dynamics
