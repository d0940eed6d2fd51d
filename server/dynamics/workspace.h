#pragma once

#include <array>
#include <optional>
#include <vector>

#include "balance.h"
#include "constraint_set.h"
#include "run.h"

namespace layfigure::dynamics {

struct Workspace::Data {
  explicit Data(const Model& model);

  void reserve(const Inputs& inputs);

  SolveReport base_step(const StepContext& context);

  // Of the last base step, which was one of a single copy:
  double largest_turn() const;
  SolveReport shorten(const StepContext& context, double part, bool constrained);
  Balance measure_balance(const StepContext& context);
  /// Rotational energy of a body and what turning added to it, as measure_balance() found them [J].
  struct Turning {
    double spin;
    double added;
  };
  [[nodiscard]] Turning turning_of(int body) const;

  std::optional<Plan<double>> narrow;     ///< one copy, body by body
  std::vector<Plan<math::Lanes4>> plans;  ///< from one copy, or from two beside `narrow`, to kMaxOrder
  std::vector<Node<double>> narrow_nodes;
  std::vector<Node<math::Lanes4>> nodes;
  // of the plan for one copy: one of the two is empty
  BalanceRecords<double> narrow_records;
  BalanceRecords<math::Lanes4> records;
  std::array<std::vector<BodyState>, kMaxOrder> runs;
  std::array<Copy, kMaxOrder> copies;
  std::array<ConstraintSet, kMaxOrder> constraints;
  bool flows{false};  ///< some joint can flow
  int finest{0};      ///< copy of the last step whose coupling forces count
};

}  // namespace layfigure::dynamics
