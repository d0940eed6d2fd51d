#pragma once

#include <vector>

#include "rigid_groups.h"
#include "run.h"

/// The energy balance of one base step of one run, measured on the states before and after it.
namespace layfigure::dynamics {

/// What the balance needs of the bodies' definitions beside Constants, slot by slot.
template <class T>
struct EnergyConstants {
  Quat<T> principal;        ///< R_BI: axes of the principal moments
  Vec3<T> inverse_moments;  ///< 1 / I
  Vec3<T> compliance;       ///< 1 / K_f, section axes; 0 on an axis without stiffness
  T inverse_mass;
  T active;  ///< 1; 0 in an idle lane
};

/// Scratch: where a body is after the step.
template <class T>
struct Moved {
  Quat<T> orientation;  ///< R_WB
  Vec3<T> shift;        ///< how far its origin went, world
  T spin;               ///< rotational kinetic energy
  T turning;            ///< its part that arose because the body turned on with a constant angular momentum
  LaneRows<T, 2> rows;  ///< orientation, shift
};

template <class T>
struct BalanceRecords {
  std::vector<EnergyConstants<T>> constants;
  std::vector<Moved<T>> moved;  ///< one more than slots, for the world
  std::vector<double> reach;    ///< of each carrier: greatest distance of its com from its root's origin [m]
  double weight_reach{0.0};     ///< sum of mass times reach [kg m]
};

/// [J]
struct Balance {
  double gained{0.0};          ///< E after the step less E before
  double input{0.0};           ///< work of loads, couplings and drives along the way that the bodies went
  double kinetic{0.0};         ///< after the step
  double turning{0.0};         ///< sum of the positive parts of Moved::turning
  double rounding{0.0};        ///< what rounding may have made of `gained` ...
  double input_rounding{0.0};  ///< ... and of `input`
};

/// Measures the step from copies[0].from to copies[0].to that `nodes` were left by. Work.input of the copy is not
/// used. O(n), a third of a base step.
Balance measure_balance(const StepContext& context, const Plan<double>& plan, const std::vector<Node<double>>& nodes,
                        BalanceRecords<double>& records);
Balance measure_balance(const StepContext& context, const Plan<math::Lanes4>& plan,
                        const std::vector<Node<math::Lanes4>>& nodes, BalanceRecords<math::Lanes4>& records);

/// Makes the records those of the groups. Allocates nothing where there are fewer than before.
template <class T>
void set_records(const Model& model, const RigidGroups& groups, const Schedule& schedule, BalanceRecords<T>& records);

}  // namespace layfigure::dynamics
