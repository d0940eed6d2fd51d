#pragma once

#include <Eigen/Core>
#include <vector>

#include "rigid_groups.h"
#include "run.h"
#include "transmission.h"

/// What is at rest sleeps, and costs nothing until it matters again.
///
/// A joint is still while its speed w would turn it by at most a hundredth of the sleep angle until it has settled:
///     |w| max(D_f / K_f, sqrt(I / K_f), (D_f + D_d) / K_f if it flows) <= angle / 100
/// with I the moment of inertia of all behind it, the largest about the joint in the definition's pose. A root that no
/// joint holds has kDwell to settle, and may move by the same part of the doll's length as well. A joint that has been
/// still for kDwell sleeps: its body rides on its parent from then on (rigid_groups.h). Joints between a contact, tie,
/// drive or load and the root, and those at their limits, do not.
///
/// A joint wakes in the step in which it would no longer stay as it is. The bodies that ride behind it in its group, of
/// mass m, com c from the joint and inertia I about the com, need the torque about the joint
///     -t = c x m (a - g) + I dw/dt + w x I w + what awake groups and couplings behind it need (transmission.h)
/// with a the acceleration of their com: all of it follows from momenta before and after the step. Where that differs
/// from the t that the joint fell asleep with by more than bends its spring by the sleep angle or makes it yield, the
/// joint wakes and the step is made again. So a pose is never further than that angle, joint by joint, from what it
/// would be without sleep, and at rest no further than a hundredth of it.
///
/// A group's motion is remembered from when its riders were last looked at, with what their torques leave to their
/// limits: a bound on the torques' change shows for most steps, at the cost of one body, that none can matter. The
/// bound decides nothing else, so what happens depends on the state alone. It does not speak of joints that transmit,
/// and ends when others transmit: a hand has let go. A joint that transmits is looked at anew when the moment that it
/// transmits has changed by a part of what its torque left, too.
namespace layfigure::dynamics {

/// For so long must be still what is to sleep [s]: longer than a doll's limbs stand still at the end of a swing, short
/// beside a person's pauses.
constexpr double kDwell = 0.1;

class Sleepers {
 public:
  explicit Sleepers(const Model& model);

  /// Which bodies are to sleep, after one of the following has said that it is not those that do.
  [[nodiscard]] const std::vector<char>& wanted() const { return wanted_; }

  /// All bodies are to wake, but for those that are welded.
  [[nodiscard]] bool wake_all(const State& state);
  /// Bodies that contacts, ties, drives or loads act on are to wake, and all between them and their roots. `loads`:
  /// those of the step, one per body, or none.
  [[nodiscard]] bool wake_touched(const Model& model, const State& state, const Inputs& inputs,
                                  std::span<const BodyForce> loads);
  /// Riders that the step would bend or make yield are to wake; their groups' motions have been observed.
  [[nodiscard]] bool wake_overloaded(const Model& model, const State& state, double angle, const RigidGroups& groups,
                                     const Transmission& transmission);
  /// Joints at rest are to sleep too.
  [[nodiscard]] bool let_sleep(const Model& model, const State& state);

  /// How a carrier's group moves in the step.
  void observe(const Model& model, const RigidGroup& group, int carrier, const Transmission::Step& step);

  /// Lengthens or ends the rest of the carriers in a step of length h from `before` to `after`.
  void count_rest(const Model& model, const std::vector<BodyState>& before, double h, double angle,
                  const std::vector<int>& carriers, std::vector<BodyState>& after);
  /// Every joint and root has been still for long enough.
  [[nodiscard]] bool all_still() const { return all_still_; }

 private:
  struct Joint {
    double settling;        ///< time constant below yield [s]
    double flow_settling;   ///< while it flows [s]
    double stiffness;       ///< smallest K_f of the axes that turn [N m/rad]
    double smallest_ratio;  ///< of the yield torques' ratios of these
    bool welded;
  };
  /// A group's motion, in its frame.
  struct Motion {
    Eigen::Vector3d specific_force;  ///< a - g of its com
    Eigen::Vector3d acceleration;    ///< angular
    Eigen::Vector3d spin;
    Eigen::Quaterniond R_CW;
    bool matters;  ///< its riders must be looked at one by one
  };
  /// The motion that a group's riders were last looked at in, and how far it may go from there: the torque of none
  /// leaves its tolerance while
  ///     force_gain |change of a - g| + spin_gain (|change of the acceleration| + w^2 + w0^2) <= 1.
  static constexpr int kForgotten = -1;  ///< no version of the groups
  struct Calm {
    int version{kForgotten};  ///< of the groups
    Motion motion;
    double force_gain;
    double spin_gain;
  };
  /// What was seen of a rider that transmits.
  struct Seen {
    Eigen::Vector3d moment;  ///< that it transmitted
    double moving;           ///< part of what was left to it that its group's calm may take [N m]
    double most;             ///< square of the change of the moment that leaves the rest untouched
  };

  [[nodiscard]] static Joint joint_of(const JointLaw& law, double moment);
  void start_from(const State& state);
  [[nodiscard]] bool differs_from(const State& state) const;
  void touch(const Model& model, const State& state, int body);
  [[nodiscard]] bool is_calm(const Calm& calm, int carrier, int version) const;
  [[nodiscard]] bool find_calm(const RigidGroups& groups);
  void forget_calm_of_others(const Transmission& transmission);
  void find_steady(const RigidGroups& groups, const Transmission& transmission, double angle);
  [[nodiscard]] double tolerance(const Model& model, const BodyState& body, int index, double angle) const;
  [[nodiscard]] double margin(const Rider& rider, const RigidGroup& group, double tolerance,
                              const Transmission& transmission) const;
  static void narrow_calm(const Rider& rider, const RigidGroup& group, double margin, Calm& calm);
  [[nodiscard]] bool stays(int rider, int carrier, const Transmission& transmission) const;
  void see(const Rider& rider, const RigidGroup& group, double margin, const Transmission& transmission);
  [[nodiscard]] bool is_still(int body, const BodyState& before, const BodyState& after, double h, double angle) const;

  std::vector<Joint> joints_;
  std::vector<char> wanted_;
  std::vector<char> touched_;
  std::vector<Motion> motions_;  ///< of the carriers
  std::vector<Calm> calm_;       ///< of the carriers, for riders that do not transmit
  int left_out_{0};              ///< Transmission::version() of those that do: calm_ does not speak of them
  std::vector<Calm> steady_;     ///< and for those that do
  std::vector<char> anew_;       ///< whether a carrier's have to be looked at anew
  std::vector<Seen> seen_;       ///< of those
  double seen_angle_{0.0};
  double reach_{0.0};  ///< of the bodies from their roots, as far as they have weight [m]
  bool touches_sleepers_{false};
  bool some_ripe_{false};  ///< a joint has been still for long enough that nothing acts on
  bool all_still_{false};
};

}  // namespace layfigure::dynamics
