#pragma once

#include <array>
#include <vector>

#include "balance.h"
#include "constraint_set.h"
#include "crew.h"
#include "group_inputs.h"
#include "plan.h"
#include "run.h"
#include "shares.h"
#include "sleepers.h"
#include "transmission.h"

namespace layfigure::dynamics {

/// What base steps write on their way, one of one copy in the nodes that the plan of one copy asks for.
struct Scratch {
  std::vector<Node<double>> narrow;
  std::vector<Node<math::Lanes4>> wide;
};

struct Workspace::Data {
  Data(const Model& model, int threads);

  /// Makes room for what so many inputs exert.
  void reserve(const Inputs& inputs);
  /// Groups the bodies as the state has them, for steps of up to `order`.
  void prepare(const Model& model, State& state, int order);
  /// Lets these bodies sleep and no others.
  void regroup(const Model& model, State& state, int order, const std::vector<char>& asleep);

  /// Gives each copy the same bits whichever others go beside it.
  SolveReport base_step(const StepContext& context, Scratch& own) const;
  /// One of a single copy, in scratch[0].
  SolveReport base_step(const StepContext& context);

  // Of the last base step, which was one of a single copy:
  double largest_turn() const;
  SolveReport shorten(const StepContext& context, double part);
  Balance measure_balance(const StepContext& context);
  /// Rotational energy of a group and what turning added to it, as measure_balance() found them [J].
  struct Turning {
    double spin;
    double added;
  };
  [[nodiscard]] Turning turning_of(int carrier) const;
  /// R_WC at its beginning.
  [[nodiscard]] Eigen::Quaterniond orientation_of(int carrier) const;

  RigidGroups groups;
  Levers levers;
  bool goes_narrow{false};                ///< a single run goes group by group
  Plan<double> narrow;                    ///< of one copy
  std::vector<Plan<math::Lanes4>> plans;  ///< of 1, 2, .. kMaxOrder copies
  std::vector<Scratch> scratch;           ///< of each thread, that of the finest run first
  std::array<Shares, kMaxOrder> shares;   ///< of the runs of order 1, 2, ..
  Crew crew;
  // of the plans of one copy
  BalanceRecords<double> narrow_records;
  BalanceRecords<math::Lanes4> records;
  std::array<std::vector<BodyState>, kMaxOrder> runs;  ///< of the carriers
  std::array<Copy, kMaxOrder> copies;
  std::array<ConstraintSet, kMaxOrder> constraints;
  Sleepers sleepers;
  Transmission transmission;
  std::vector<Eigen::Quaterniond> orientations;  ///< R_WC of the carriers in the last step
  std::vector<BodyForce> loads;                  ///< of the step's end, on all bodies
  GroupInputs group_inputs;
  bool flows{false};  ///< some joint can flow
  int finest{0};      ///< copy of the last step whose coupling forces count
  static constexpr int kNoFactors = -1;
  int factored_version{kNoFactors};  ///< of the groups that the factors in the nodes of one copy are for

 private:
  void arrange(const Model& model, int count);
  void choose_width(const Model& model);

  std::array<std::size_t, 4> reserved_{};  ///< numbers of inputs of each kind that there is room for
  std::array<int, kMaxOrder> arranged_;    ///< version of the groups that each of the plans is for
};

}  // namespace layfigure::dynamics
