#include "extrapolation.h"

#include <algorithm>
#include <cmath>

#include "lane_transfer.h"
#include "layfigure/math/kernel.h"

namespace layfigure::dynamics {
namespace {

/// An entry for each run of an order, row order - 1.
using Weights = std::array<std::array<double, kMaxOrder>, kMaxOrder>;

/// n^(order - lowering) / product of (n - i) over the other runs i, for the runs of n = 1, 2, .. order sub-steps. Both
/// parts are integers that a double holds, so each quotient is the nearest number to the exact one.
constexpr Weights quotients(int lowering) {
  Weights weights{};
  for (int order = 1; order <= kMaxOrder; ++order) {
    for (int n = 1; n <= order; ++n) {
      double power = 1.0;
      double product = 1.0;
      for (int i = 0; i < order - lowering; ++i) power *= n;
      for (int i = 1; i <= order; ++i) product *= i == n ? 1 : n - i;
      weights[order - 1][n - 1] = power / product;
    }
  }
  return weights;
}

// Aitken-Neville weights: they cancel the error terms h, h^2, .. h^(order - 1).
constexpr Weights kWeights = quotients(1);
// Those of order p less those of order p - 1 that leave out the first run.
constexpr Weights kErrorWeights = quotients(2);

using Pack = math::Lanes4;
using Runs = std::array<std::vector<BodyState>, kMaxOrder>;
using Rotation = Eigen::Quaterniond BodyState::*;

/// The bodies that runs hold, in packs: behind the last body, the last again.
struct Carriers {
  const std::vector<int>& indices;
  [[nodiscard]] int at(std::size_t place) const { return indices[std::min(place, indices.size() - 1)]; }
};

/// Rotations of up to four bodies from the one at place `first` on in one run, side by side.
Quat<Pack> rotations_of(const std::vector<BodyState>& run, Rotation member, Carriers carriers, std::size_t first) {
  return gather_rotations<Pack>([&](int k) { return &run[carriers.at(first + k)]; }, member);
}

/// Weighted sum of the runs' rotations from the finest one on, by the log map. Weights that sum to one make it a
/// weighted mean, in which the weight of the finest itself does not show.
Vec3<Pack> combine(const Runs& runs, Rotation member, Carriers carriers, std::size_t first, const double* weights,
                   int order) {
  const Quat<Pack> finest = conjugate(rotations_of(runs[order - 1], member, carriers, first));
  Vec3<Pack> sum{};
  for (int k = 0; k + 1 < order; ++k) {
    sum += scaled(math::log_rotation(finest * rotations_of(runs[k], member, carriers, first)), weights[k]);
  }
  return sum;
}

/// Puts the combined rotations in the place of the finest run's, where the runs differ at all.
LAYFIGURE_KERNEL
void extrapolate_rotations(Runs& runs, Rotation member, Carriers carriers, const double* weights, int order) {
  std::vector<BodyState>& finest = runs[order - 1];
  for (std::size_t first = 0; first < carriers.indices.size(); first += math::LaneTraits<Pack>::kCount) {
    const Vec3<Pack> correction = combine(runs, member, carriers, first, weights, order);
    const Pack size = dot(correction, correction);
    if (!math::any(size > Pack(0.0))) continue;
    const Quat<Pack> mean =
        renormalized(rotations_of(finest, member, carriers, first) * math::exp_rotation(correction));
    for (std::size_t k = 0; k < math::LaneTraits<Pack>::kCount && first + k < carriers.indices.size(); ++k) {
      if (math::lane(size, static_cast<int>(k)) <= 0.0) continue;
      finest[carriers.indices[first + k]].*member = lane(mean, static_cast<int>(k));
    }
  }
}

LAYFIGURE_KERNEL
double largest_correction(const Runs& runs, Carriers carriers, const double* weights, int order) {
  Pack largest(0.0);
  for (std::size_t first = 0; first < carriers.indices.size(); first += math::LaneTraits<Pack>::kCount) {
    const Vec3<Pack> difference = combine(runs, &BodyState::rotation, carriers, first, weights, order);
    largest = math::maximum(largest, dot(difference, difference));
  }
  double most = 0.0;
  for (int k = 0; k < math::LaneTraits<Pack>::kCount; ++k) most = std::max(most, math::lane(largest, k));
  return std::sqrt(most);
}

/// Runs first .. end - 1.
struct Share {
  int first;
  int end;
};

/// What the sub-steps of a share came to.
struct Made {
  std::array<int, kMaxOrder> solves{};  ///< of each sub-step, those of runs that go side by side counted once
  int run_solves{0};
  bool converged{true};
  bool finite{true};
};

/// Where sub-step `sub` of a run begins and what acts on it.
void begin_sub_step(const State& state, Workspace::Data& data, const Inputs& inputs, const Interval& interval, int run,
                    int sub) {
  Copy& copy = data.copies[run];
  copy.from = sub == 0 ? state.bodies.data() : data.runs[run].data();
  copy.to = data.runs[run].data();
  copy.h = interval.length / (run + 1);
  copy.offset = interval.offset + sub * copy.h;
  if (sub == 0) copy.work = {};
  if (inputs.loads != nullptr) take_loads(*inputs.loads, state.time + (sub + 1) * copy.h, data.groups, copy);
}

Made make_share(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
                const Interval& interval, const Share& share, Scratch& scratch) {
  Made made;
  const Eigen::Vector3d& g = model.gravity();
  for (int run = share.first; run < share.end; ++run) data.constraints[run].start(state.constraints, inputs);
  for (int sub = 0; sub < share.end; ++sub) {
    const int first = std::max(share.first, sub);
    const std::span<Copy> active(data.copies.data() + first, share.end - first);
    for (int run = first; run < share.end; ++run) begin_sub_step(state, data, inputs, interval, run, sub);
    const SolveReport solved = data.base_step({.model = &model,
                                               .law = model.law(),
                                               .gravity = {g.x(), g.y(), g.z()},
                                               .time = state.time,
                                               .inputs = &inputs,
                                               .copies = active,
                                               .minds_energy = false},
                                              scratch);
    made.solves[sub] = solved.solves;
    for (const Copy& copy : active) made.run_solves += copy.solves;
    made.converged = made.converged && solved.converged;
    made.finite = made.finite && solved.finite;
  }
  return made;
}

/// The same report whatever the shares.
StepReport joined(std::span<const Made> shares) {
  StepReport report;
  std::array<int, kMaxOrder> solves{};
  for (const Made& made : shares) {
    for (int sub = 0; sub < kMaxOrder; ++sub) solves[sub] = std::max(solves[sub], made.solves[sub]);
    report.run_solves += made.run_solves;
    report.converged = report.converged && made.converged;
    if (!made.finite) report.status = StepStatus::kNotFinite;
  }
  for (const int most : solves) report.solves += most;
  return report;
}

}  // namespace

void take_loads(const Loads& loads, double time, const RigidGroups& groups, Copy& copy) {
  std::fill(copy.loads.begin(), copy.loads.end(), BodyForce{});
  loads.add(time, copy.loads);
  carry_loads(groups, copy);
}

StepReport make_runs(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
                     const Interval& interval, int order) {
  const Shares& shares = data.shares[order - 1];
  std::array<Made, kMaxOrder> made;
  data.crew.run(shares.count, [&](int part) {
    const Share share{.first = shares.ends[part], .end = shares.ends[part + 1]};
    made[part] = make_share(model, state, data, inputs, interval, share, data.scratch[shares.count - 1 - part]);
  });
  data.factored_version = data.groups.version();
  StepReport report = joined({made.data(), static_cast<std::size_t>(shares.count)});
  report.extrapolated = order > 1;
  for (int k = 0; k + 1 < order; ++k) {
    report.extrapolated = report.extrapolated && data.constraints[k].agrees_with(data.constraints[order - 1]);
  }
  report.constraints = data.constraints[order - 1].report();
  return report;
}

void extrapolate(Workspace::Data& data, int order) {
  const double* weights = kWeights[order - 1].data();
  for (const int i : data.groups.carriers()) {
    BodyState& body = data.runs[order - 1][i];
    body.limit_slack = 0.0;  // the slack was that of the finest run's rotations
    double flow = weights[order - 1] * body.flow;
    for (int k = 0; k + 1 < order; ++k) flow += weights[k] * data.runs[k][i].flow;
    body.flow = flow;
    const auto combine_vectors = [&](Eigen::Vector3d BodyState::*member) {
      Eigen::Vector3d sum = weights[order - 1] * (body.*member);
      for (int k = 0; k + 1 < order; ++k) sum += weights[k] * (data.runs[k][i].*member);
      body.*member = sum;
    };
    combine_vectors(&BodyState::linear_momentum);
    combine_vectors(&BodyState::angular_momentum);
    if (data.groups.group(i).parent < 0) combine_vectors(&BodyState::position);
  }
  const Carriers carriers{data.groups.carriers()};
  extrapolate_rotations(data.runs, &BodyState::rotation, carriers, weights, order);
  if (data.flows) extrapolate_rotations(data.runs, &BodyState::rest_rotation, carriers, weights, order);
}

void take_result(Workspace::Data& data, int order, double length, State& state, StepReport& report) {
  const std::vector<int>& carriers = data.groups.carriers();
  const std::vector<Rider>& riders = data.groups.riders();
  std::vector<BodyState>& result = data.runs[order - 1];
  if (riders.size() < carriers.size()) {
    for (const Rider& rider : riders) result[rider.body] = state.bodies[rider.body];
    std::swap(state.bodies, result);
  } else {
    for (const int i : carriers) state.bodies[i] = result[i];
  }
  state.time += length;
  report.work = data.copies[order - 1].work;
  const std::vector<ConstraintMemory>& memory = data.constraints[order - 1].memory();
  state.constraints.assign(memory.begin(), memory.end());
  for (const int i : carriers) report.yielding += state.bodies[i].yielding ? 1 : 0;
  report.asleep = static_cast<int>(riders.size());
}

double extrapolation_error(const Workspace::Data& data, int order) {
  return largest_correction(data.runs, Carriers{data.groups.carriers()}, kErrorWeights[order - 1].data(), order);
}

}  // namespace layfigure::dynamics
