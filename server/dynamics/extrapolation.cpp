#include "extrapolation.h"

#include <algorithm>
#include <cmath>

#include "layfigure/math/rotation.h"

namespace layfigure::dynamics {
namespace {

// Aitken-Neville weights of the runs with 1, 2, .. order sub-steps: they cancel the error terms h, h^2, .. h^(order-1).
constexpr double kWeights[kMaxOrder][kMaxOrder] = {
    {1.0, 0.0, 0.0, 0.0},
    {-1.0, 2.0, 0.0, 0.0},
    {1.0 / 2, -4.0, 9.0 / 2, 0.0},
    {-1.0 / 6, 4.0, -27.0 / 2, 32.0 / 3},
};
// Those of order p less those of order p - 1, which leaves out the first run.
constexpr double kErrorWeights[kMaxOrder][kMaxOrder] = {
    {0.0, 0.0, 0.0, 0.0},
    {-1.0, 1.0, 0.0, 0.0},
    {1.0 / 2, -2.0, 3.0 / 2, 0.0},
    {-1.0 / 6, 2.0, -9.0 / 2, 8.0 / 3},
};

void take_loads(const Loads& loads, double time, Copy& copy) {
  std::fill(copy.loads.begin(), copy.loads.end(), BodyForce{});
  loads.add(time, copy.loads);
}

/// Weighted mean of rotations by the log map about the last, in which the weights of a plain sum are exact.
Eigen::Quaterniond extrapolate(const std::array<Eigen::Quaterniond, kMaxOrder>& runs, const double* weights,
                               int order) {
  const Eigen::Quaterniond& finest = runs[order - 1];
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();
  for (int k = 0; k + 1 < order; ++k) {
    correction += weights[k] * math::log_rotation(finest.conjugate() * runs[k]);
  }
  return (finest * math::exp_rotation(correction)).normalized();
}

}  // namespace

StepReport make_runs(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs,
                     const Interval& interval, int order) {
  StepReport report;
  for (int sub = 0; sub < order; ++sub) {
    const std::span<Copy> active(data.copies.data() + sub, order - sub);
    for (int k = sub; k < order; ++k) {
      Copy& copy = data.copies[k];
      copy.from = sub == 0 ? state.bodies.data() : data.runs[k].data();
      copy.to = data.runs[k].data();
      copy.h = interval.length / (k + 1);
      copy.offset = interval.offset + sub * copy.h;
      if (sub == 0) copy.work = {};
      if (inputs.loads != nullptr) take_loads(*inputs.loads, state.time + (sub + 1) * copy.h, copy);
    }
    const Eigen::Vector3d& g = model.gravity();
    const SolveReport solved = data.base_step({.law = model.law(),
                                               .gravity = {g.x(), g.y(), g.z()},
                                               .time = state.time,
                                               .inputs = &inputs,
                                               .copies = active});
    report.solves += solved.solves;
    report.converged = report.converged && solved.converged;
    if (!solved.finite) report.status = StepStatus::kNotFinite;
  }
  return report;
}

void extrapolate(Workspace::Data& data, int order) {
  const double* weights = kWeights[order - 1];
  for (std::size_t i = 0; i < data.runs[0].size(); ++i) {
    BodyState& body = data.runs[order - 1][i];
    std::array<Eigen::Quaterniond, kMaxOrder> rotations, rests;
    bool flowed = false;
    for (int k = 0; k < order; ++k) {
      rotations[k] = data.runs[k][i].rotation;
      rests[k] = data.runs[k][i].rest_rotation;
      flowed = flowed || rests[k].coeffs() != rests[0].coeffs();
    }
    body.rotation = extrapolate(rotations, weights, order);
    if (flowed) body.rest_rotation = extrapolate(rests, weights, order);
    double flow_sum = 0.0;
    for (int k = 0; k < order; ++k) flow_sum += weights[k] * data.runs[k][i].flow;
    body.flow = flow_sum;
    for (const auto member : {&BodyState::position, &BodyState::linear_momentum, &BodyState::angular_momentum}) {
      Eigen::Vector3d sum = weights[order - 1] * (body.*member);
      for (int k = 0; k + 1 < order; ++k) sum += weights[k] * (data.runs[k][i].*member);
      body.*member = sum;
    }
  }
}

void take_result(Workspace::Data& data, int order, double length, State& state, StepReport& report) {
  std::swap(state.bodies, data.runs[order - 1]);
  state.time += length;
  report.work = data.copies[order - 1].work;
  for (const BodyState& body : state.bodies) report.yielding += body.yielding ? 1 : 0;
}

double extrapolation_error(const Workspace::Data& data, int order) {
  const double* weights = kErrorWeights[order - 1];
  double largest = 0.0;
  for (std::size_t i = 0; i < data.runs[0].size(); ++i) {
    const Eigen::Quaterniond& finest = data.runs[order - 1][i].rotation;
    Eigen::Vector3d difference = Eigen::Vector3d::Zero();
    for (int k = 0; k + 1 < order; ++k) {
      difference += weights[k] * math::log_rotation(finest.conjugate() * data.runs[k][i].rotation);
    }
    largest = std::max(largest, difference.squaredNorm());
  }
  return std::sqrt(largest);
}

}  // namespace layfigure::dynamics
