#include "layfigure/dynamics/advance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "extrapolation.h"
#include "ledger.h"

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

/// What the last step of the call tells of those to come.
struct Experience {
  double h{0.0};  ///< its length
  int order{0};   ///< 0: there was no step with estimates
  Errors errors{};
};

Experience learn(const Workspace::Data& data, double h, int order) {
  Experience learnt{.h = h, .order = order};
  for (int q = kLowestOrder; q <= order; ++q) learnt.errors[q - 1] = extrapolation_error(data, q);
  return learnt;
}

/// By how much the length of a step of this order may grow. Not bounded below, so that orders can be compared.
double growth_of(double error, double tolerance, int order) {
  return error == 0.0 ? kLargestGrowth : std::min(kSafety * std::pow(tolerance / error, 1.0 / order), kLargestGrowth);
}

/// The next step: the order that goes furthest for its solves.
StepSize choose(const Experience& last, double tolerance) {
  StepSize best;
  double most = 0.0;
  for (int q = kLowestOrder; q <= last.order; ++q) {
    const double growth = growth_of(last.errors[q - 1], tolerance, q);
    if (growth / solves_of(q) <= most) continue;
    most = growth / solves_of(q);
    best = {.step = last.h * std::max(growth, kLargestCut), .order = q};
  }
  // If the highest order that was tried is the best, the next may be better still.
  if (best.order == last.order && best.order < kMaxOrder) ++best.order;
  return best;
}

/// Length of the next step: the wanted one, the end of the duration, or two even steps rather than one and a scrap.
double next_length(double wanted, double left, double smallest) {
  return wanted >= left ? left : std::min(wanted, std::max(0.5 * left, smallest));
}

/// Solves that may still be made.
struct Budget {
  double left;
  double per_sub_step{1.0};      ///< as Newton's method took in the last step
  int highest_order{kMaxOrder};  ///< 1 after a step that was not finite

  explicit Budget(int most) : left(most > 0 ? most : std::numeric_limits<double>::infinity()) {}

  [[nodiscard]] double cost(int order) const { return solves_of(order) * per_sub_step; }
  [[nodiscard]] double steps(int order) const { return std::floor(left / cost(order)); }
  void take(const StepReport& step, int order) {
    left -= step.run_solves;
    per_sub_step = std::max(1.0, step.run_solves / solves_of(order));
  }
};

/// A step to make.
struct Choice {
  double h;
  int order;
  bool forced;  ///< the budget does not reach further: its error does not matter
};

/// The order whose even steps over the time that is left promise the smallest error.
Choice spread(const Budget& budget, double left, const Experience& last, int wanted_order) {
  const auto even = [&](int q) -> Choice {
    return {.h = left / std::max(budget.steps(q), 1.0), .order = q, .forced = true};
  };
  const auto fits = [&](int q) { return q <= budget.highest_order && budget.steps(q) >= 1.0; };
  Choice best = even(1);
  double least = std::numeric_limits<double>::infinity();
  for (int q = kLowestOrder; q <= (last.order > 0 ? last.order : wanted_order) && fits(q); ++q) {
    const double error = budget.steps(q) * last.errors[q - 1] * std::pow(even(q).h / last.h, q);
    // Without experience the highest order is thought the best.
    if (last.order > 0 && !(error < least)) continue;
    least = error;
    best = even(q);
  }
  if (best.order == last.order && fits(best.order + 1)) return even(best.order + 1);
  return best;
}

/// The step that the tolerance asks for, if the budget lasts for as many more as reach the end, and one solve over.
Choice choose_within(const Budget& budget, double left, double wanted, int order, const Experience& last,
                     const AdvanceOptions& options) {
  const double h = next_length(wanted, left, options.smallest_step);
  if (std::ceil(left / h) * budget.cost(order) + 1.0 <= budget.left) return {.h = h, .order = order, .forced = false};
  return spread(budget, left, last, order);
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
  data.reserve(inputs);
  state.rest = {};
  data.prepare(model, state, kMaxOrder);
  if (data.sleepers.wake_all(state)) data.regroup(model, state, kMaxOrder, data.sleepers.wanted());
  const Inputs& acting = data.group_inputs.map(inputs, data.groups);
  AdvanceReport report;
  Budget budget(options.most_solves);
  Experience last;
  for (double done = 0.0; done < duration;) {
    const double left = duration - done;
    const double wanted = std::clamp(size.step, options.smallest_step, options.largest_step);
    const int wanted_order = std::clamp(size.order, kLowestOrder, kMaxOrder);
    const auto [h, order, forced] = choose_within(budget, left, wanted, wanted_order, last, options);
    StepReport step = make_step(model, state, data, acting, {.offset = done, .length = h}, order);
    budget.take(step, order);
    report.solves += step.solves;
    report.run_solves += step.run_solves;
    const bool shortest = order == 1 || h <= (step.extrapolated ? options.smallest_step : options.impact_step);
    if (step.status != StepStatus::kOk) {
      if (shortest) {
        report.status = step.status;
        return report;
      }
      last = {};
      if (forced) budget.highest_order = 1;
      size = {.step = kLargestCut * h, .order = kLowestOrder};
      ++report.rejected;
      continue;
    }
    last = learn(data, h, order);
    const double error = last.errors[order - 1];
    const StepSize next = order > 1 ? choose(last, options.tolerance) : size;
    if (error > options.tolerance && !shortest && !forced) {
      size = {.step = std::min(next.step, kRepeatCut * h), .order = std::min(next.order, order)};
      ++report.rejected;
      continue;
    }
    if (step.extrapolated) extrapolate(data, order);
    take_result(data, order, h, state, step);
    add(step, error, report);
    report.fell_short = report.fell_short || (forced && (order == 1 || error > options.tolerance));
    // A step cut short by the end of the duration says nothing against the length that was wanted.
    size = {.step = h < wanted ? std::max(next.step, wanted) : next.step, .order = next.order};
    done = h == left ? duration : done + h;
  }
  return report;
}

}  // namespace layfigure::dynamics
