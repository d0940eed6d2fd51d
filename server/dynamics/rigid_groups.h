#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "inertia.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/math/lanes.h"

/// The bodies as they move. A body that is asleep (state.h) rides on its parent, which may ride itself: what carries
/// them all is the first body on the way to the root whose joint moves, and together they are one rigid body, a group
/// in the carrier's frame C. A step works on the groups alone.
namespace layfigure::dynamics {

/// Mass properties of several bodies as of one, in frame C.
struct Composite {
  double mass{0.0};
  Eigen::Vector3d com{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d inertia{Eigen::Matrix3d::Zero()};  ///< about the com

  /// Two rigid bodies as one. The distance of their coms enters with the reduced mass, so that nothing cancels.
  void add(const Composite& other);
};

/// The composite seen from another frame: R_FC, p_FoCo_F.
[[nodiscard]] Composite turned(const Composite& composite, const Eigen::Quaterniond& rotation,
                               const Eigen::Vector3d& origin);

struct RigidGroup {
  int parent;                ///< carrier of the group that its joint hangs on; -1: a root
  Eigen::Vector3d anchor;    ///< of its joint, in that group's frame; a root: zero [m]
  Eigen::Quaterniond mount;  ///< of the joint's own parent in that group's frame
  bool mounted;              ///< the parent rides itself
  double mass;
  Eigen::Vector3d com;
  PrincipalInertia inertia;
  Eigen::Vector3d lever;  ///< from its com to the carrier's own
  int riders;
};

/// A unit ball, for lanes that nothing reads.
[[nodiscard]] RigidGroup idle_group();

/// A body that rides.
struct Rider {
  int body;
  int carrier;
  Eigen::Quaterniond rotation;  ///< R_CB
  Eigen::Vector3d origin;       ///< p_CoBo_C: of its joint
  Eigen::Vector3d lever;        ///< from the group's com to its own
  Composite behind;             ///< the body and the riders of the same group that hang on it
  // the joint's state when it fell asleep
  Eigen::Quaterniond joint_rotation;
  Eigen::Vector3d torque;
  double yield_scale;
};

/// What a sleeper's state is while nobody changes it by hand; its linear momentum is none.
struct Still {
  int body;
  math::Lanes4 rotation;  ///< of the joint
  math::Lanes4 angular;   ///< momentum: none, and the yield scale
};

/// How a group moves.
struct GroupMotion {
  Eigen::Quaterniond orientation;  ///< R_WC
  Eigen::Vector3d spin;            ///< w_WC, world
  Eigen::Vector3d velocity;        ///< of its com, world
};

class RigidGroups {
 public:
  /// Every body a group of its own.
  explicit RigidGroups(const Model& model);

  /// The state's sleepers are the riders, where they were, and hold no momentum of their own. O(n)
  [[nodiscard]] bool describes(const State& state) const;
  /// Makes them so. Momenta that sleepers hold go to their carriers'. O(n), allocates nothing.
  void assign(const Model& model, State& state);
  /// Changes with each assign() and regroup().
  [[nodiscard]] int version() const { return version_; }

  /// Lets other bodies sleep; the state is one that describes() holds for. Momenta are kept: those of a group are
  /// spread on its bodies as they move, and united anew. Bodies that were not at rest to each other lose that energy,
  /// as in a plastic impact; nothing is ever added. O(n), allocates nothing.
  void regroup(const Model& model, State& state, const std::vector<char>& asleep);

  /// For schedules: of each body the carrier that it hangs on, -1 for roots, Schedule::kAbsent for riders.
  [[nodiscard]] const std::vector<int>& parents() const { return parents_; }
  [[nodiscard]] const std::vector<int>& carriers() const { return carriers_; }
  [[nodiscard]] const std::vector<Rider>& riders() const { return riders_; }
  [[nodiscard]] const RigidGroup& group(int carrier) const { return groups_[carrier]; }
  [[nodiscard]] bool rides(int body) const { return rider_of_[body] >= 0; }
  [[nodiscard]] const Rider& rider(int body) const { return riders_[rider_of_[body]]; }
  /// R_WC, for bodies of which the carriers' entries alone are read. O(depth)
  [[nodiscard]] Eigen::Quaterniond orientation(const BodyState* bodies, int carrier) const;
  /// How the group of a carrier moves. O(depth)
  [[nodiscard]] GroupMotion motion(const BodyState* bodies, int carrier) const;
  [[nodiscard]] int carrier_of(int body) const { return rides(body) ? rider(body).carrier : body; }

 private:
  void group(const Model& model, const State& state);
  void place(const Model& model, const State& state, int body);
  void sum_up(const Model& model);
  void spread_momenta(State& state);
  void unite_momenta(State& state);
  void hand_over(const Rider& rider, const Eigen::Quaterniond& R_WC, State& state) const;
  [[nodiscard]] Composite part(const Rider& rider) const;

  std::vector<Composite> own_;  ///< of each body, in its own frame
  std::vector<PrincipalInertia> principal_;
  std::vector<int> parents_;
  std::vector<int> carriers_;
  std::vector<int> rider_of_;  ///< index in riders_, -1: a carrier
  std::vector<Rider> riders_;  ///< in tree order
  std::vector<Still> still_;   ///< of each rider
  std::vector<RigidGroup> groups_;
  std::vector<Composite> sums_;       ///< scratch
  std::vector<GroupMotion> motions_;  ///< of each carrier, scratch
  int version_{0};
};

}  // namespace layfigure::dynamics
