#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <span>

#include "layfigure/dynamics/constraints.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"

namespace layfigure::dynamics {

/// A force and a torque on a body, in the world, the force acting at the com.
struct BodyForce {
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};   ///< [N]
  Eigen::Vector3d torque{Eigen::Vector3d::Zero()};  ///< [N m]
};

/// Forces on the bodies as a function of time. A step takes them at the end of each of its sub-steps.
class Loads {
 public:
  virtual ~Loads() = default;
  /// Adds to `forces` (one entry per body) what acts at `time` [s]. Must not allocate. Where the workspace has several
  /// threads, several call it at once.
  virtual void add(double time, std::span<BodyForce> forces) const = 0;
};

/// A virtual coupling: a spring and damper between a point of a body and a moving target, solved implicitly with the
/// step, so it is stable at any stiffness. It pins, grabs and drives. A compliant row of Tazaki & Hasegawa's form
/// without bounds is exactly an addition to the held body's inertia and momentum, so it costs no constraint solve.
struct Coupling {
  int body{0};
  Eigen::Vector3d point{Eigen::Vector3d::Zero()};                      ///< held point, in the body's frame [m]
  Eigen::Quaterniond orientation{Eigen::Quaterniond::Identity()};      ///< R_BA of the held frame A in the body's
  double stiffness{0.0};                                               ///< [N/m], >= 0
  double damping{0.0};                                                 ///< [N s/m], >= 0
  double angular_stiffness{0.0};                                       ///< [N m/rad], >= 0; 0: a 3-DOF coupling
  double angular_damping{0.0};                                         ///< [N m s/rad], >= 0
  Eigen::Vector3d target_position{Eigen::Vector3d::Zero()};            ///< world [m], at the beginning of the step
  Eigen::Quaterniond target_rotation{Eigen::Quaterniond::Identity()};  ///< R_WA wanted, at the beginning of the step
  Eigen::Vector3d target_velocity{Eigen::Vector3d::Zero()};            ///< world [m/s], constant through the step
  Eigen::Vector3d target_angular_velocity{Eigen::Vector3d::Zero()};    ///< world [rad/s], constant through the step
};

/// Turns a joint towards a rotation, beside the joint's own law: a motor, a puppet's string, motion capture. With e the
/// rotation vector from the joint's rotation to the target and w, w_target their angular velocities relative to the
/// parent, the torque on the child is the spring-damper's
///     d = K e[n+1] + B (w_target - w[n+1])  =  K e + B w_target - (h K + B) w,      e to the sub-step's end
/// shortened to `max_torque` where it is longer, in whatever direction. This is the gradient of a convex function of w,
/// so the step stays the minimum of one at any stiffness, and has no row: a drive is an addition to its joint's law.
///
/// It acts on the rotation R_PB, not on the rest rotation: the joint's spring pulls against it, and flows where that
/// strains it beyond its yield torque. What the drive has turned so far stays when it lets go; less, and the joint
/// springs back.
struct Drive {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  int body{0};                   ///< behind the joint. A root that no joint holds is not driven
  double stiffness{0.0};         ///< K [N m/rad], >= 0; what is above kRigidStiffness is taken as this
  double damping{0.0};           ///< B [N m s/rad], >= 0
  double max_torque{kInfinity};  ///< length of the torque at most [N m], >= 0
  Eigen::Quaterniond target_rotation{Eigen::Quaterniond::Identity()};  ///< R_PB wanted, at the beginning of the step
  Eigen::Vector3d target_velocity{Eigen::Vector3d::Zero()};  ///< angular, of the target relative to the parent and in
                                                             ///< its axes [rad/s], constant through the step
};

/// What acts on the doll in a step beside gravity and its joints.
struct Inputs {
  const Loads* loads{nullptr};
  std::span<const Coupling> couplings{};
  std::span<const Contact> contacts{};  ///< as they are at the beginning of the step
  std::span<const Tie> ties{};
  std::span<const Drive> drives{};
};

/// The highest order. The combination magnifies rounding by the sum of its weights' sizes, 300 at order 6.
constexpr int kMaxOrder = 6;

struct StepOptions {
  double step{1e-3};  ///< h [s], > 0
  int order{1};       ///< 1 to kMaxOrder: convergence order; solves as much as 1, 3, 6, 10, 15, 21 base steps
  /// By how much what sleeps may be off before it wakes, joint by joint [rad], >= 0; 0: nothing sleeps.
  double sleep_angle{0.0};
};

/// A good choice: half a millimetre at the end of half a metre [rad].
constexpr double kSleepAngle = 1e-3;

enum class StepStatus {
  kOk,
  kNotFinite,      ///< the state would not be finite; it was left as it was
  kCreatesEnergy,  ///< no part of a base step could be made to keep the energy ledger; the state was left as it was
};

/// Energy that crossed the doll's border or was turned into heat in a step [J]: the ledger. A base step keeps
///     E[n+1] - E[n] <= input - viscous - flow - constraints
/// to rounding, which is Energy::rounding of both energies and `rounding`; what is missing is numerical damping.
/// Forces do their work along the way that their points go, the springs of couplings by what they lose, drives with the
/// torque of the step's end. The works of the extrapolated orders are those of their finest run, whose ways are taken
/// straight.
struct Work {
  double input{0.0};        ///< done on the doll by loads, couplings and drives
  double viscous{0.0};      ///< lost in the joints' dampers D_f
  double flow{0.0};         ///< plastic work: lost in the joints' flow
  double constraints{0.0};  ///< taken by contacts, ties and limits, by friction mainly; negative where they push
  double rounding{0.0};     ///< what rounding may have made of these in a base step
};

struct StepReport {
  StepStatus status{StepStatus::kOk};
  int solves{0};           ///< O(n) solves, those of runs that go side by side counted once
  int run_solves{0};       ///< the same, those of each run counted: what a step costs goes with them
  int yielding{0};         ///< joints that flowed in the last sub-step
  bool converged{true};    ///< every Newton iteration met its tolerance
  int retries{0};          ///< parts of a base step that were made again at half their length
  int asleep{0};           ///< bodies that slept through the step
  bool resting{false};     ///< the doll was at rest as a whole: nothing was computed, nothing but the time has changed
  double taken_back{0.0};  ///< energy from nowhere that was taken back from the momenta in a base step [J]
  /// The runs of an order above 1 were combined. They are not where a contact, tie or limit acted in some of their
  /// sub-steps and not, or not in the same way, in others; the result is then that of the finest run, base steps of h /
  /// order.
  bool extrapolated{false};
  ConstraintReport constraints;  ///< of the finest run
  Work work;                     ///< of the finest run
};

/// Scratch memory of a step for one model, allocated once. One per thread that steps.
class Workspace {
 public:
  /// `threads`: how many may share the runs of an order above 1, 1 to kMaxOrder (what is beyond is taken for the
  /// nearest of these): the one that steps and helpers, which wait here for steps to share, awake for some 0.1 ms after
  /// each. They take part where that makes the step sooner done, which the tree and the order tell: a doll of 52 joints
  /// from order 3 on; a chain never, whose runs fill the lanes. No bit of a state depends on it; Work may, in its last
  /// digits. Throws std::system_error where the system has no more threads.
  explicit Workspace(const Model& model, int threads = 1);
  ~Workspace();
  Workspace(Workspace&&) noexcept;
  Workspace& operator=(Workspace&&) noexcept;

  /// What coupling `index` of the last step's inputs exerted on its body at the held point, world, at the step's end.
  [[nodiscard]] const BodyForce& coupling_force(int index) const;

  /// What drive `index` of the last step's inputs exerted on its body, and the opposite on the parent, at the step's
  /// end, world [N m].
  [[nodiscard]] const Eigen::Vector3d& drive_torque(int index) const;

  /// What contact `index` of the last step's inputs exerted on its body a at the step's end, world [N].
  [[nodiscard]] const Eigen::Vector3d& contact_force(int index) const;
  /// What tie `index` of the last step's inputs exerted on its body a at the held point at the step's end, world.
  [[nodiscard]] const BodyForce& tie_force(int index) const;

  struct Data;
  [[nodiscard]] Data& data() { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

/// How a body moves, world.
struct BodyVelocity {
  Eigen::Vector3d angular;  ///< [rad/s]
  Eigen::Vector3d linear;   ///< of its com [m/s]
};

/// Velocities of all bodies, of those that sleep too, from the momenta; `poses` are the state's. O(n). `velocities` is
/// resized to model.size(); no allocation when it already has that size. Momenta that sleepers hold go to those that
/// they ride on.
void world_velocities(const Model& model, State& state, Workspace& workspace, const std::vector<BodyPose>& poses,
                      std::vector<BodyVelocity>& velocities);

/// Norms of a body's velocities.
struct BodySpeed {
  double angular;  ///< [rad/s]
  double linear;   ///< of its com [m/s]
};

/// The norms alone, for half of the time.
void world_speeds(const Model& model, State& state, Workspace& workspace, const std::vector<BodyPose>& poses,
                  std::vector<BodySpeed>& speeds);

/// Advances `state` by options.step.
///
/// Order 1 is the base step, an implicit Euler step by momentum projection: with the configuration q[n] and the bodies'
/// momenta P[n], find the joint velocities w with
///     J^T (M J w - P[n] - h F) + h t(w) = 0,     q[n+1] = q[n] exp(h w),     P[n+1] = M J w
/// where t(w) is the joint law (joint_law.h), implicit. It is the minimum of a convex function, found by Newton's
/// method on the law's regimes with an O(n) articulated-body recursion for each linear solve. No velocity-product terms
/// appear. What the ways of the bodies curve away from their velocities in a step could create energy: a base step
/// never does. Where it would, the excess is taken back from the momenta; where it is much, or the state would not be
/// finite, the step is made in up to 8 shorter parts, and the shortest may end early on their way. Orders 2 to 6
/// extrapolate it (Aitken-Neville) over 1, 2, .. order sub-steps: momenta linearly, rotations by the log map about the
/// finest run.
///
/// The orders show where the step resolves the joints' own rates: that of a body of moment I at a joint's damper D_f is
/// D_f / I. Where h / order is about the inverse of the fastest one, the observed order falls to about 2, with an error
/// that is the smaller the higher the order is: the order reduction of stiff equations (Auzinger, Frank, Macsek 1990,
/// "Asymptotic error expansions for stiff equations: the implicit Euler scheme"; Hairer & Wanner II, VI.5). Orders 5
/// and 6 therefore pay for errors of 1e-5 m and less on a doll.
///
/// With a sleep angle joints at rest sleep: what hangs on them rides rigidly on their parents and costs nothing, until
/// something would move it so that the joints did not stay as they are (sleepers.h). The doll at rest as a whole stays
/// as it is until its inputs change. Falling asleep keeps the momenta and never adds energy; waking keeps both. Bodies
/// of joints that are rigid and never yield are always one.
///
/// O(n) per solve, a base step at most 15 of them and as many passes over the bodies again; no heap allocation once
/// `workspace` has seen as many couplings and drives. Throws nothing. On a status other than kOk the state is
/// unchanged, but that sleepers may have woken. Not thread-safe for one workspace or state.
[[nodiscard]] StepReport step(const Model& model, State& state, Workspace& workspace, const Inputs& inputs,
                              const StepOptions& options);

}  // namespace layfigure::dynamics
