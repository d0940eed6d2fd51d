#pragma once

#include <array>
#include <optional>
#include <vector>

#include "constraint_set.h"
#include "run.h"

namespace layfigure::dynamics {

constexpr int kMaxOrder = 4;

struct Workspace::Data {
  explicit Data(const Model& model);

  void reserve_couplings(std::size_t count);

  SolveReport base_step(const StepContext& context);

  std::optional<Plan<double>> narrow;     ///< one copy, body by body
  std::vector<Plan<math::Lanes4>> plans;  ///< from one copy, or from two beside `narrow`, to kMaxOrder
  std::vector<Node<double>> narrow_nodes;
  std::vector<Node<math::Lanes4>> nodes;
  std::array<std::vector<BodyState>, kMaxOrder> runs;
  std::array<Copy, kMaxOrder> copies;
  std::array<ConstraintSet, kMaxOrder> constraints;
  int finest{0};  ///< copy of the last step whose coupling forces count
};

}  // namespace layfigure::dynamics
