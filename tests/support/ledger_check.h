#pragma once

#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"

namespace layfigure::testing {

/// What a base step created, E[n+1] - E[n] - (input - viscous - flow - constraints), beyond what rounding may make of
/// it [J]; > 0 breaks the ledger.
inline double created(const dynamics::Energy& before, const dynamics::StepReport& report,
                      const dynamics::Energy& after) {
  const dynamics::Work& work = report.work;
  const double excess = after.total() - before.total() - (work.input - work.viscous - work.flow - work.constraints);
  return excess - (before.rounding + after.rounding + work.rounding);
}

}  // namespace layfigure::testing
