#include "layfigure/dynamics/step.h"

#include <algorithm>

#include "ledger.h"

namespace layfigure::dynamics {

StepReport step(const Model& model, State& state, Workspace& workspace, const Inputs& inputs,
                const StepOptions& options) {
  Workspace::Data& data = workspace.data();
  const int order = std::clamp(options.order, 1, kMaxOrder);
  data.reserve(inputs);
  StepReport report = make_step(model, state, data, inputs, {.offset = 0.0, .length = options.step}, order);
  if (report.status != StepStatus::kOk) return report;
  if (report.extrapolated) extrapolate(data, order);
  take_result(data, order, options.step, state, report);
  return report;
}

}  // namespace layfigure::dynamics
