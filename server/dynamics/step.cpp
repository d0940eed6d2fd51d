#include "layfigure/dynamics/step.h"

#include <algorithm>

#include "ledger.h"

namespace layfigure::dynamics {

StepReport step(const Model& model, State& state, Workspace& workspace, const Inputs& inputs,
                const StepOptions& options) {
  Workspace::Data& data = workspace.data();
  const int order = std::clamp(options.order, 1, kMaxOrder);
  data.reserve_couplings(inputs.couplings.size());
  data.finest = order - 1;
  const Interval whole{.offset = 0.0, .length = options.step};
  StepReport report = order > 1 ? make_runs(model, state, data, inputs, whole, order)
                                : make_base_steps(model, state, data, inputs, whole);
  if (report.status != StepStatus::kOk) return report;
  if (report.extrapolated) extrapolate(data, order);
  take_result(data, order, options.step, state, report);
  return report;
}

}  // namespace layfigure::dynamics
