#include "layfigure/dynamics/step.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "axis_law.h"
#include "layfigure/math/rotation.h"
#include "run.h"

namespace layfigure::dynamics {
namespace {

constexpr int kMaxOrder = 4;
// Aitken-Neville weights of the runs with 1, 2, .. order sub-steps: they cancel the error terms h, h^2, .. h^(order-1).
constexpr double kWeights[kMaxOrder][kMaxOrder] = {
    {1.0, 0.0, 0.0, 0.0},
    {-1.0, 2.0, 0.0, 0.0},
    {1.0 / 2, -4.0, 9.0 / 2, 0.0},
    {-1.0 / 6, 4.0, -27.0 / 2, 32.0 / 3},
};
// A single run works on several bodies at once where that fills at least half of the lanes; a chain does not.
constexpr double kWorthwhileFill = 0.5;

template <class T>
void set_body(const BodyDefinition& body, RootKind root, int k, Constants<T>& constants) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(body.inertia);
  const Eigen::Vector3d moments =
      axes.eigenvalues().cwiseMax(kSmallestGyration * kSmallestGyration * body.mass).eval();
  const auto dyad = [&](int axis) -> Eigen::Vector3d {
    return axes.eigenvectors().col(axis) * std::sqrt(moments[axis] - moments[0]);
  };
  const bool free = body.parent < 0 && root == RootKind::kFree;
  const bool fixed = body.parent < 0 && root == RootKind::kFixed;
  math::set_lane(constants.mass, k, body.mass);
  math::set_lane(constants.anchor, k, body.parent < 0 ? Eigen::Vector3d::Zero() : body.anchor);
  math::set_lane(constants.com, k, body.com);
  math::set_lane(constants.inertia, k, moments[0]);
  math::set_lane(constants.u, k, dyad(1));
  math::set_lane(constants.v, k, dyad(2));
  const JointLaw law = free || fixed ? JointLaw{} : body.joint;
  set_lane(constants.section, k, law.shape.axes);
  set_lane(constants.stiffness, k, axis_stiffness(law));
  set_lane(constants.damping, k, axis_damping(law));
  set_lane(constants.inverse_shape, k, axis_inverse_shape(law));
  math::set_lane(constants.flow_damping, k, law.flow_damping);
  math::set_lane(constants.yield, k, law.yield_torque);
  math::set_lane(constants.hardening, k, law.hardening);
  math::set_lane(constants.free, k, free ? 1.0 : 0.0);
  math::set_lane(constants.fixed, k, fixed ? 1.0 : 0.0);
  constants.roots = constants.roots || free || fixed;
  constants.flows = constants.flows || std::isfinite(law.yield_torque);
  constants.isotropic = constants.isotropic && is_isotropic(law);
}

template <class T>
Plan<T> make_plan(const Model& model, int copies) {
  std::vector<int> parents;
  for (int i = 0; i < model.size(); ++i) parents.push_back(model.body(i).parent);
  Plan<T> plan{.schedule = Schedule(parents, copies, math::LaneTraits<T>::kCount), .constants = {}};
  // An idle lane computes the motion of a unit ball that nothing reads.
  const BodyDefinition idle;
  for (int slot = 0; slot < plan.schedule.size(); ++slot) {
    Constants<T>& constants = plan.constants.emplace_back();
    constants.roots = constants.flows = false;
    constants.isotropic = true;
    for (int k = 0; k < plan.schedule.lanes(); ++k) {
      const Task& task = plan.schedule.tasks(slot)[k];
      set_body(task.copy < 0 ? idle : model.body(task.body), task.copy < 0 ? RootKind::kBall : model.root(), k,
               constants);
    }
  }
  return plan;
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

struct Workspace::Data {
  explicit Data(const Model& model) {
    const int n = model.size();
    Plan<math::Lanes4> wide = make_plan<math::Lanes4>(model, 1);
    if (wide.schedule.size() * wide.schedule.lanes() * kWorthwhileFill <= n) {
      plans.push_back(std::move(wide));
    } else {
      narrow.emplace(make_plan<double>(model, 1));
      narrow_nodes.resize(n + 1);
    }
    for (int count = 2; count <= kMaxOrder; ++count) plans.push_back(make_plan<math::Lanes4>(model, count));
    nodes.resize(plans.back().schedule.size() + 1);
    const State start = initial_state(model);
    for (int k = 0; k < kMaxOrder; ++k) {
      runs[k] = start.bodies;
      copies[k].loads.resize(n);
    }
  }

  void reserve_couplings(std::size_t count) {
    for (Copy& copy : copies) copy.coupling_forces.resize(count);
  }

  SolveReport base_step(const StepContext& context) {
    const int count = static_cast<int>(context.copies.size());
    if (count == 1 && narrow) return dynamics::base_step(context, *narrow, narrow_nodes);
    return dynamics::base_step(context, plans[count - (narrow ? 2 : 1)], nodes);
  }

  std::optional<Plan<double>> narrow;     ///< one copy, body by body
  std::vector<Plan<math::Lanes4>> plans;  ///< from one copy, or from two beside `narrow`, to kMaxOrder
  std::vector<Node<double>> narrow_nodes;
  std::vector<Node<math::Lanes4>> nodes;
  std::array<std::vector<BodyState>, kMaxOrder> runs;
  std::array<Copy, kMaxOrder> copies;
  int finest{0};  ///< copy of the last step whose coupling forces count
};

Workspace::Workspace(const Model& model) : data_(std::make_unique<Data>(model)) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

const BodyForce& Workspace::coupling_force(int index) const {
  return data_->copies[data_->finest].coupling_forces[index];
}

namespace {

void take_loads(const Loads& loads, double time, Copy& copy) {
  std::fill(copy.loads.begin(), copy.loads.end(), BodyForce{});
  loads.add(time + copy.offset + copy.h, copy.loads);
}

/// Run k makes k + 1 sub-steps of h / (k + 1); all that still have sub-steps to make, make them together.
StepReport make_runs(const Model& model, const State& state, Workspace::Data& data, const Inputs& inputs, double h,
                     int order) {
  StepReport report;
  for (int sub = 0; sub < order; ++sub) {
    const std::span<Copy> active(data.copies.data() + sub, order - sub);
    for (int k = sub; k < order; ++k) {
      Copy& copy = data.copies[k];
      copy.from = sub == 0 ? state.bodies.data() : data.runs[k].data();
      copy.to = data.runs[k].data();
      copy.h = h / (k + 1);
      copy.offset = sub * copy.h;
      if (sub == 0) copy.work = {};
      if (inputs.loads != nullptr) take_loads(*inputs.loads, state.time, copy);
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

/// Combines the runs in the finest one's place.
void extrapolate_runs(Workspace::Data& data, int order) {
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

}  // namespace

StepReport step(const Model& model, State& state, Workspace& workspace, const Inputs& inputs,
                const StepOptions& options) {
  Workspace::Data& data = workspace.data();
  const int order = std::clamp(options.order, 1, kMaxOrder);
  data.reserve_couplings(inputs.couplings.size());
  data.finest = order - 1;
  StepReport report = make_runs(model, state, data, inputs, options.step, order);
  if (report.status != StepStatus::kOk) return report;
  report.work = data.copies[order - 1].work;
  if (order > 1) extrapolate_runs(data, order);
  state.time += options.step;
  std::swap(state.bodies, data.runs[order - 1]);
  for (const BodyState& body : state.bodies) report.yielding += body.yielding ? 1 : 0;
  return report;
}

}  // namespace layfigure::dynamics
