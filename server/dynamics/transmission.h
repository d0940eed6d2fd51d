#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "rigid_groups.h"
#include "run.h"

/// What the joints of riders transmit beside what the rigid bodies behind them need (sleepers.h): the reactions of
/// awake groups that hang on these, and what couplings pull at them. By d'Alembert's principle a group needs, from its
/// joint and all groups behind it together, the force and the moment about its com
///     F = dp/dt - m g - f,   N = dL/dt - n
/// with f, n the couplings and loads on it, so that no constraint or joint torque inside the tree need be known.
namespace layfigure::dynamics {

class Transmission {
 public:
  explicit Transmission(int bodies);

  /// A step of length h, of which the carriers' entries are read.
  struct Step {
    const std::vector<BodyState>& before;
    const std::vector<BodyState>& after;
    const std::vector<Eigen::Quaterniond>& orientations;  ///< R_WC in it
    double h;
  };
  /// What acted in it.
  struct Pulls {
    std::span<const Coupling> on_bodies;  ///< the inputs
    std::span<const Coupling> on_groups;  ///< the same on the carriers
    std::span<const BodyForce> forces;    ///< theirs
    std::span<const BodyForce> loads;     ///< on the groups, one per body, or none
  };

  /// Room for so many couplings; allocates where there were never as many.
  void reserve(std::size_t couplings) { pulled_.reserve(couplings); }

  /// O(n); nothing where no rider transmits any of it.
  void measure(const Model& model, const RigidGroups& groups, const Step& step, const Pulls& pulls);

  /// Changes with the riders that transmit.
  [[nodiscard]] int version() const { return marks_; }
  /// The riders that transmit any.
  [[nodiscard]] const std::vector<int>& transmitting() const { return transmitting_; }
  [[nodiscard]] bool transmits(int rider) const { return transmits_[rider] != 0; }
  /// Moment about the rider's joint, in its carrier's frame [N m].
  [[nodiscard]] const Eigen::Vector3d& moment(int rider) const { return moments_[rider]; }

 private:
  struct Wrench {
    Eigen::Vector3d force;
    Eigen::Vector3d moment;  ///< about the joint of the group
  };

  [[nodiscard]] Wrench needed_by(const Model& model, const RigidGroup& group, int carrier, const Step& step,
                                 const Pulls& pulls) const;
  void mark(const Model& model, const RigidGroups& groups, int body);
  [[nodiscard]] bool knows(const RigidGroups& groups, std::span<const Coupling> couplings) const;
  void find_riders(const Model& model, const RigidGroups& groups, std::span<const Coupling> couplings);
  /// Adds a wrench at the point p_C of the carrier to all riders from `body` on.
  void carry(const Model& model, const RigidGroups& groups, int body, const Eigen::Quaterniond& R_WC,
             const Eigen::Vector3d& point, const Wrench& wrench);

  std::vector<char> transmits_;
  std::vector<int> transmitting_;
  int marks_{0};             ///< how often these have been found
  int version_{-1};          ///< of the groups that they are for ...
  std::vector<int> pulled_;  ///< ... and the bodies of the couplings
  std::vector<Eigen::Vector3d> moments_;
  std::vector<Wrench> needed_;  ///< by each group and all behind it, world
};

}  // namespace layfigure::dynamics
