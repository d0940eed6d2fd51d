#pragma once

#include "run.h"

/// Eliminates the joints of the last base step anew with a part of their gains, for ports.h. The step's own factors are
/// lost; the configuration and the laws' regimes stay.
namespace layfigure::dynamics {

enum class GainPart {
  kDamping,  ///< h D, and all of the gain of joints that flow
  kNone,
};

void eliminate_with(GainPart part, const Plan<double>& plan, std::vector<Node<double>>& nodes);
void eliminate_with(GainPart part, const Plan<math::Lanes4>& plan, std::vector<Node<math::Lanes4>>& nodes);

}  // namespace layfigure::dynamics
