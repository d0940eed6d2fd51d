#include "ledger.h"

#include <algorithm>
#include <cmath>

namespace layfigure::dynamics {
namespace {

// Shortest part of a step: 2^-kHalvings of it. A step costs at most 2^(kHalvings + 1) - 1 base steps.
constexpr int kHalvings = 3;
constexpr int kParts = 1 << kHalvings;
// A correction of more than this part of the kinetic energy says that the step is too long for what happens in it.
constexpr double kLargestCut = 0.25;
// What a step linearises holds for turns of up to about a radian.
constexpr double kShortTurn = 1.0;
constexpr int kShortenings = 20;
// Where almost all is taken back, the rounding of what is taken must not stay.
constexpr double kTakeAll = 1.0 + 1e-14;
constexpr double kLossRounding = 0.1 * kEnergyRounding;

/// One attempt at a part of a step.
struct Attempt {
  SolveReport solved;
  Balance balance;
  double excess{0.0};  ///< energy from nowhere [J]
  double taken{0.0};   ///< part of it that was taken back
};

void take_back_turning(const Workspace::Data& data, double part, BodyState* bodies) {
  for (const int i : data.groups.carriers()) {
    const auto [spin, turning] = data.turning_of(i);
    if (turning > 0.0) bodies[i].angular_momentum *= std::sqrt(std::max(1.0 - part * turning / spin, 0.0));
  }
}

void scale_momenta(double factor, const std::vector<int>& carriers, BodyState* bodies) {
  for (const int i : carriers) {
    bodies[i].linear_momentum *= factor;
    bodies[i].angular_momentum *= factor;
  }
}

/// Takes the attempt's excess back from the momenta. False if that is too much for them.
bool settle(Workspace::Data& data, Attempt& attempt) {
  const Balance& balance = attempt.balance;
  const double turning = std::min(attempt.excess, balance.turning);
  const double rest = attempt.excess - turning;
  const double kinetic = balance.kinetic - turning;
  const double left = kinetic - rest;
  if (rest > 0.0 && !(left >= (1.0 - kLargestCut) * kinetic)) return false;
  if (turning > 0.0) take_back_turning(data, turning / balance.turning, data.copies[0].to);
  if (rest > 0.0) scale_momenta(std::sqrt(left / kinetic), data.groups.carriers(), data.copies[0].to);
  attempt.taken = attempt.excess;
  return true;
}

void measure(const StepContext& context, Workspace::Data& data, Attempt& attempt) {
  Work& work = data.copies[0].work;
  attempt.balance = data.measure_balance(context);
  work.input = attempt.balance.input;
  work.rounding += attempt.balance.input_rounding + kLossRounding * (work.viscous + work.flow);
  attempt.excess = attempt.balance.gained - work.input + work.viscous + work.flow + work.constraints;
  attempt.solved.finite = std::isfinite(attempt.excess);
}

Attempt attempt_step(const StepContext& context, Workspace::Data& data) {
  data.copies[0].work = {};
  Attempt attempt{.solved = data.base_step(context), .balance = {}};
  if (attempt.solved.finite && !attempt.solved.dissipative) measure(context, data, attempt);
  return attempt;
}

/// Whether the attempt keeps the ledger, or could be made to.
bool keeps_ledger(Workspace::Data& data, Attempt& attempt) {
  if (!attempt.solved.finite) return false;
  if (attempt.solved.dissipative) return true;
  const double rounding = attempt.balance.rounding + data.copies[0].work.rounding;
  if (attempt.excess <= rounding) return true;
  attempt.excess *= kTakeAll;
  return settle(data, attempt);
}

/// Makes the attempt end earlier on its way until that keeps the ledger. False if it never does.
bool shorten(const StepContext& context, Workspace::Data& data, Attempt& attempt) {
  const double turn = data.largest_turn();
  if (!std::isfinite(turn)) return attempt.solved.finite = false;
  double part = std::min(0.5, kShortTurn / turn);
  for (int k = 0; k < kShortenings; ++k) {
    data.copies[0].work = {};
    const SolveReport report = data.shorten(context, part);
    attempt.solved.finite = report.finite;
    if (report.finite) measure(context, data, attempt);
    if (keeps_ledger(data, attempt)) return true;
    part = 0.5;
  }
  return false;
}

void add(const Attempt& attempt, const Work& work, StepReport& report) {
  report.converged = report.converged && attempt.solved.converged;
  report.taken_back += attempt.taken;
  report.work.input += work.input;
  report.work.viscous += work.viscous;
  report.work.flow += work.flow;
  report.work.constraints += work.constraints;
  report.work.rounding += work.rounding;
}

}  // namespace

StepReport make_base_steps(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
                           const Interval& interval) {
  StepReport report;
  Copy& copy = data.copies[0];
  const Eigen::Vector3d& g = model.gravity();
  data.constraints[0].start(state.constraints, inputs);
  const StepContext context{.model = &model,
                            .law = model.law(),
                            .gravity = {g.x(), g.y(), g.z()},
                            .time = state.time,
                            .inputs = &inputs,
                            .copies = {data.copies.data(), 1},
                            .minds_energy = true};
  int halvings = 0;
  for (int done = 0; done < kParts;) {
    const int parts = kParts >> halvings;
    const double begun = interval.length * done / kParts;
    copy.from = done == 0 ? state.bodies.data() : data.runs[0].data();
    copy.to = data.runs[1].data();
    copy.h = interval.length * parts / kParts;
    copy.offset = interval.offset + begun;
    if (inputs.loads != nullptr) {
      take_loads(*inputs.loads, state.time + begun + copy.h, data.groups, copy);
    }
    Attempt attempt = attempt_step(context, data);
    report.solves += attempt.solved.solves;
    report.run_solves = report.solves;
    const bool shortest = halvings == kHalvings;
    const bool sound = keeps_ledger(data, attempt) && (attempt.solved.converged || shortest);
    if (sound || (shortest && shorten(context, data, attempt))) {
      add(attempt, copy.work, report);
      std::swap(data.runs[0], data.runs[1]);
      done += parts;
      // A longer part may do again from here on.
      while (halvings > 0 && done % (kParts >> (halvings - 1)) == 0) --halvings;
    } else if (halvings < kHalvings) {
      ++halvings;
      ++report.retries;
    } else {
      report.status = attempt.solved.finite ? StepStatus::kCreatesEnergy : StepStatus::kNotFinite;
      return report;
    }
  }
  copy.work = report.work;
  report.constraints = data.constraints[0].report();
  return report;
}

StepReport make_step(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
                     const Interval& interval, int order) {
  data.finest = order - 1;
  return order > 1 ? make_runs(model, state, data, inputs, interval, order)
                   : make_base_steps(model, state, data, inputs, interval);
}

}  // namespace layfigure::dynamics
