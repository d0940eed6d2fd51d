#include "layfigure/dynamics/advance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "extrapolation.h"

namespace layfigure::dynamics {
namespace {

constexpr double kSafety = 0.9;
// A length changes by no more than these at once: the estimate says little about lengths far from its own.
constexpr double kLargestGrowth = 4.0;
constexpr double kLargestCut = 0.1;
// A step that is made again is shorter by at least this.
constexpr double kRepeatCut = 0.7;
// Order 1 has no estimate.
constexpr int kLowestOrder = 2;

double solves_of(int order) { return 0.5 * order * (order + 1); }

/// Error estimates of the orders 2 .. order, at [order - 1].
using Errors = std::array<double, kMaxOrder>;

Errors estimate(const Workspace::Data& data, int order) {
  Errors errors{};
  for (int q = kLowestOrder; q <= order; ++q) errors[q - 1] = extrapolation_error(data, q);
  return errors;
}

double growth_of(double error, double tolerance, int order) {
  if (error == 0.0) return kLargestGrowth;
  return std::clamp(kSafety * std::pow(tolerance / error, 1.0 / order), kLargestCut, kLargestGrowth);
}

/// The next step: the order that goes furthest for its solves.
StepSize choose(const Errors& errors, double tolerance, double h, int order) {
  StepSize best;
  double most = 0.0;
  for (int q = kLowestOrder; q <= order; ++q) {
    const double step = h * growth_of(errors[q - 1], tolerance, q);
    if (step / solves_of(q) <= most) continue;
    most = step / solves_of(q);
    best = {.step = step, .order = q};
  }
  // If the highest order that was tried is the best, the next may be better still.
  if (best.order == order && order < kMaxOrder) ++best.order;
  return best;
}

/// Length of the next step: the wanted one, the end of the duration, or two even steps rather than one and a scrap.
double next_length(double wanted, double left, double smallest) {
  return wanted >= left ? left : std::min(wanted, std::max(0.5 * left, smallest));
}

void add(const StepReport& step, double error, AdvanceReport& report) {
  ++report.steps;
  report.yielding = step.yielding;
  report.converged = report.converged && step.converged;
  report.constraints = step.constraints;
  report.largest_error = std::max(report.largest_error, error);
  report.work.input += step.work.input;
  report.work.viscous += step.work.viscous;
  report.work.flow += step.work.flow;
  report.work.constraints += step.work.constraints;
}

}  // namespace

AdvanceReport advance(const Model& model, State& state, Workspace& workspace, const Inputs& inputs, double duration,
                      const AdvanceOptions& options, StepSize& size) {
  Workspace::Data& data = workspace.data();
  data.reserve_couplings(inputs.couplings.size());
  AdvanceReport report;
  for (double done = 0.0; done < duration;) {
    const double left = duration - done;
    const double wanted = std::clamp(size.step, options.smallest_step, options.largest_step);
    const double h = next_length(wanted, left, options.smallest_step);
    const int order = std::clamp(size.order, kLowestOrder, kMaxOrder);
    data.finest = order - 1;
    StepReport step = make_runs(model, state, data, inputs, {.offset = done, .length = h}, order);
    const bool shortest = h <= (step.extrapolated ? options.smallest_step : options.impact_step);
    report.solves += step.solves;
    if (step.status != StepStatus::kOk && shortest) {
      report.status = step.status;
      return report;
    }
    const bool finite = step.status == StepStatus::kOk;
    const Errors errors = finite ? estimate(data, order) : Errors{};
    const double error = errors[order - 1];
    const StepSize next =
        finite ? choose(errors, options.tolerance, h, order) : StepSize{.step = kLargestCut * h, .order = kLowestOrder};
    if (!finite || (error > options.tolerance && !shortest)) {
      size = {.step = std::min(next.step, kRepeatCut * h), .order = std::min(next.order, order)};
      ++report.rejected;
      continue;
    }
    if (step.extrapolated) extrapolate(data, order);
    take_result(data, order, h, state, step);
    add(step, error, report);
    // A step cut short by the end of the duration says nothing against the length that was wanted.
    size = {.step = h < wanted ? std::max(next.step, wanted) : next.step, .order = next.order};
    done = h == left ? duration : done + h;
  }
  return report;
}

}  // namespace layfigure::dynamics
