#pragma once

#include <array>
#include <span>
#include <vector>

#include "layfigure/dynamics/joint_law.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/math/spatial.h"
#include "schedule.h"

namespace layfigure::dynamics {

using math::Mat3;
using math::Quat;
using math::Sym3;
using math::Vec3;

/// What the solver needs of the bodies, each with those that ride on it (rigid_groups.h), in one cache-friendly record
/// per slot.
template <class T>
struct alignas(64) Constants {
  bool mounted;    ///< some lane's mount is not the identity
  bool based;      ///< some lane's body hangs on the world
  bool roots;      ///< some lane is free or fixed
  bool flows;      ///< some lane has a joint with a finite yield torque
  bool limited;    ///< some lane's joint has limits
  bool isotropic;  ///< every lane's law is the same in all directions
  bool uneven;     ///< some lane's law differs more than mildly between the axes (axis_law.h)
  T mass;
  T reported;      ///< 1 for bodies of the last copy, whose work a step reports, 0 elsewhere
  Vec3<T> anchor;  ///< in the frame of what carries the joint's own parent
  Vec3<T> com;
  // I = inertia 1 + u u^T + v v^T about the com, in the body's axes: always symmetric and positive semidefinite.
  T inertia;
  Vec3<T> u;
  Vec3<T> v;
  // the joint's law in the axes of its section
  Vec3<T> stiffness;
  Vec3<T> damping;
  Vec3<T> inverse_shape;
  T flow_damping;
  T yield;
  T hardening;
  T unlimited;      ///< infinite where the joint has no limits, 0 elsewhere
  T anisotropic;    ///< 1 where the joint's law differs between the axes, and in idle lanes, 0 elsewhere
  T sectional;      ///< 1 where it does so more than mildly, and in idle lanes, 0 elsewhere
  T free;           ///< 1 for a root that no joint holds
  T fixed;          ///< 1 for a root that is welded to the world
  Quat<T> section;  ///< R_BS
  Quat<T> mount;    ///< of the joint's own parent in the frame of what carries it
};

/// Articulated inertia [[A, H], [H^T, M]] and momentum target (b_angular, b_linear) of a body, or what a child adds to
/// it.
template <class T>
struct Articulated {
  Sym3<T> A;
  Mat3<T> H;
  Sym3<T> M;
  Vec3<T> b_angular;
  Vec3<T> b_linear;
};

template <class T>
inline Articulated<T>& operator+=(Articulated<T>& sum, const Articulated<T>& child) {
  sum.A += child.A;
  sum.H += child.H;
  sum.M += child.M;
  sum.b_angular += child.b_angular;
  sum.b_linear += child.b_linear;
  return sum;
}

/// The state of the body in each lane; that of an idle lane is some body's.
template <class T>
struct Bodies {
  Quat<T> rotation;
  Quat<T> rest;
  Vec3<T> linear_momentum;
  Vec3<T> angular_momentum;
  Vec3<T> trial_torque;
  T flow;
  T yield_scale;
  T limit_slack;
};

template <class T>
constexpr int kLanes = math::LaneTraits<T>::kCount;

/// Numbers of the body in each lane that other slots read, lane by lane, four by four.
template <class T, int kRows>
struct alignas(32) LaneRows {
  std::array<std::array<double, 4 * kRows>, kLanes<T>> lanes;
};

/// Rows that hold an Articulated of one lane.
constexpr int kArticulatedRows = 7;

/// What a base step needs of the bodies' states to the end.
template <class T>
struct Before {
  Quat<T> rotation;
  Quat<T> rest;
  Vec3<T> linear_momentum;
  T flow;
  T yield_scale;
  T limit_slack;
};

template <class T>
struct BodyVelocities {
  Vec3<T> w_WB;
  Vec3<T> v_WB;
  Vec3<T> w_PB;
};

template <class Mask, class T>
inline BodyVelocities<T> select(const Mask& mask, const BodyVelocities<T>& yes, const BodyVelocities<T>& no) {
  return {math::select(mask, yes.w_WB, no.w_WB), math::select(mask, yes.v_WB, no.v_WB),
          math::select(mask, yes.w_PB, no.w_PB)};
}

/// Scratch of the bodies of one slot in one base step. World axes, origin at the body's joint, unless said. What every
/// step uses comes first, and side by side what is used together: a step's time goes to the caches as much as to sums.
template <class T>
struct alignas(64) Node {
  T h;              ///< length of the step
  bool held;        ///< couplings hold some lane's body
  bool driven;      ///< drives turn some lane's joint
  bool elastic;     ///< linearised below yield in every lane
  bool skewed;      ///< axes and motion differ
  bool in_section;  ///< some lane's factor is in section axes ...
  bool mixed;       ///< ... and some other's is not
  Before<T> before;
  // kinematics
  Quat<T> orientation;
  Mat3<T> axes;  ///< of the joint's section: a torque of the law is axes t, u = axes^T (w_WB - W) its velocity
  Vec3<T> r;     ///< from the parent's origin
  Vec3<T> c;     ///< from the origin to the com
  Vec3<T> u;
  Vec3<T> v;
  // momenta that the bodies would have if nothing held them, about the com
  Vec3<T> target_linear;
  Vec3<T> target_angular;
  // factor: angular velocity = y + P W - B V from the parent's velocity W, V carried to this joint
  Mat3<T> P;
  Mat3<T> B;
  Vec3<T> y;
  // velocities of the body
  Vec3<T> w_WB;
  Vec3<T> v_WB;
  Vec3<T> w_PB;  ///< relative to the parent, in the axes of the law: an angular velocity, or its strain's rate
  // joint law, section axes
  Vec3<T> elastic_torque;  ///< K_f q_f[n]
  StepLaw<T> law;
  Vec3<T> trial;         ///< s at which the law is linearised ...
  Return<T> linearized;  ///< ... and what it gave
  // last accepted Newton iterate, section axes: relative velocity and affine part of the gradient
  Vec3<T> iterate;
  Vec3<T> affine;
  T slack;      ///< the joint can turn by this before its limits matter [rad]
  T sectional;  ///< 1 in the lanes whose factors are in section axes, 0 elsewhere; in mixed slots
  // where the law is not the same in all directions
  Vec3<T> strain;  ///< q_f[n], section axes
  Mat3<T> motion;  ///< the inverse of axes^T, w_WB - W = motion u
  // what drives add to the law: gain and residual, section axes
  T drives;  ///< 1 in the lanes whose joints are driven, 0 elsewhere
  Sym3<T> drive_gain;
  Vec3<T> drive_residual;
  Articulated<T> spring;  ///< what couplings add
  Articulated<T> root;    ///< of the lanes that hold free roots
  T slope;                ///< the law's part of the slope in the line search
  // for other slots
  LaneRows<T, kArticulatedRows> passed;  ///< to the parents: an Articulated seen from their joints ...
  Articulated<T> passed_whole;           ///< ... or this, if the schedule passes the slot's whole
  LaneRows<T, 1> orientation_rows;
  LaneRows<T, 2> velocity_rows;  ///< w_WB, v_WB
  BodyVelocities<T> put_by;      ///< of the lanes whose copies have constraints and settled before others (newton.h)
};

template <class T>
inline const Mat3<T>& motion_of(const Node<T>& node) {
  return node.skewed ? node.motion : node.axes;
}

class ConstraintSet;

/// A coupling over one sub-step: force = pull - resistance u, with u the velocity of the held point (or of the held
/// frame).
struct CouplingTerms {
  Vec3<double> r;  ///< held point from the body's origin, world
  double resistance;
  Vec3<double> pull;
  double angular_resistance;
  Vec3<double> angular_pull;
};

/// A drive (step.h) in a sub-step, world axes. Against the relative angular velocity w of its joint it exerts t: s
/// shortened to the largest torque, with the trial torque s = resistance w - pull.
struct DriveTerms {
  int slot;
  int lane;
  double resistance;  ///< h K + B
  Vec3<double> pull;  ///< K e + B w_target
  double max_torque;
  // linearised: t = share (s - direction direction^T (s - trial))
  Vec3<double> trial;
  Vec3<double> direction;  ///< of the trial torque; 0 where it is within the largest torque
  double share;
  // last accepted Newton iterate: w and affine part of the gradient
  Vec3<double> iterate;
  Vec3<double> affine;
};

/// One copy of the doll in a step: a run of its own with its own step length. Others may be made on other threads.
struct alignas(64) Copy {
  const BodyState* from{nullptr};              ///< the bodies before the sub-step ...
  BodyState* to{nullptr};                      ///< ... and after it; may be the same
  std::vector<BodyForce> loads;                ///< of the sub-step, one per body
  std::vector<CouplingTerms> couplings;        ///< of the sub-step, one per coupling
  std::vector<BodyForce> coupling_forces;      ///< of the sub-step, one per coupling
  std::vector<DriveTerms> drives;              ///< of the sub-step, one per drive
  std::vector<Eigen::Vector3d> drive_torques;  ///< of the sub-step, one per drive
  double h{0.0};                               ///< length of its sub-steps [s]
  double offset{0.0};                          ///< of the sub-step from the step's beginning [s]
  Work work;                                   ///< of all its sub-steps
  ConstraintSet* constraints{nullptr};         ///< its contacts, ties and limits
  // of the sub-step: how Newton's method fares
  int solves{0};
  bool settled{false};      ///< it has ended ...
  bool converged{false};    ///< ... within its tolerance
  bool constrained{false};  ///< there are contacts, ties or limits to solve for
  double fraction{1.0};     ///< part of the way to the newest solution that the next iterate takes; 0: settled
};

template <class T>
struct BoundConstants;

/// A schedule with the definitions in its layout.
template <class T>
struct Plan {
  Schedule schedule;
  std::vector<Constants<T>> constants;
  std::vector<int> limited;               ///< the bodies whose joints have limits
  std::vector<int> flowing;               ///< the bodies whose joints have finite yield torques
  std::vector<BoundConstants<T>> bounds;  ///< creation_bound.h
};

/// What every lane of a base step shares.
struct StepContext {
  const Model* model;
  FlowLaw law;
  Vec3<double> gravity;
  double time;  ///< at the beginning of the whole step [s]
  const Inputs* inputs;
  std::span<Copy> copies;  ///< those that step, as many as the schedule's
  bool minds_energy;       ///< a single copy steps, which may not create energy
};

struct SolveReport {
  int solves{0};
  bool finite{true};
  bool converged{true};
  bool constrained{false};  ///< there were contacts, ties or limits to solve for
  bool dissipative{false};  ///< where energy is minded: under gravity alone, it surely created none
};

/// The part of the constraints in a base step (constrain.cpp). `begin` makes a copy's rows of the sub-step. The others
/// are for all copies that have rows and have not settled: `renew` follows every elimination of the joints. `solve`
/// applies impulses to the factors; true: the velocities must be computed anew, and solve again. `finish` takes the
/// final velocities, of all copies.
template <class T>
void begin_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy);
void renew_constraints(const StepContext& context);
template <class T>
bool solve_constraints(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes);
template <class T>
void finish_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes);
/// Theirs in Newton's line search (newton.h).
template <class T>
void measure_constraints(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes);
double constraint_slope(const Copy& copy);
void accept_constraints(const StepContext& context, bool first);

/// One base step of every copy. `nodes` has one entry per slot and one for the world.
SolveReport base_step(const StepContext& context, const Plan<double>& plan, std::vector<Node<double>>& nodes);
SolveReport base_step(const StepContext& context, const Plan<math::Lanes4>& plan,
                      std::vector<Node<math::Lanes4>>& nodes);

/// The largest rotation of a body in the world in the last base step [rad].
double largest_turn(const Plan<double>& plan, const std::vector<Node<double>>& nodes);
double largest_turn(const Plan<math::Lanes4>& plan, const std::vector<Node<math::Lanes4>>& nodes);

/// Makes the last base step end a part of its way, with velocities that are smaller alike, without another solve. Rows
/// keep their impulses. The copies' work is added to.
SolveReport shorten(const StepContext& context, const Plan<double>& plan, std::vector<Node<double>>& nodes,
                    double part);
SolveReport shorten(const StepContext& context, const Plan<math::Lanes4>& plan, std::vector<Node<math::Lanes4>>& nodes,
                    double part);

}  // namespace layfigure::dynamics
