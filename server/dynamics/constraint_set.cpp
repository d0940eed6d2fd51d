#include "constraint_set.h"

#include <algorithm>
#include <cmath>

#include "lane_transfer.h"
#include "layfigure/math/rotation.h"

namespace layfigure::dynamics {
namespace {

using Kind = ConstraintBlock::Kind;

// A row that the problem left out is taken in when it is violated by more than this [m/s] or [rad/s]: a picometre in
// a millisecond.
constexpr double kViolation = 1e-9;
// Relative to a position's size: some additions of it along a path.
constexpr double kPositionRounding = 1e-15;
// Friction that uses this much of its cone slides.
constexpr double kSliding = 1.0 - 1e-9;

std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  return (hash ^ value) * 0x9e3779b97f4a7c15ULL + (hash >> 29);
}

}  // namespace

void ConstraintSet::reserve(int bodies) { tree_.reserve(bodies); }

void ConstraintSet::reserve_forces(const Inputs& inputs) {
  contact_forces_.resize(inputs.contacts.size(), Eigen::Vector3d::Zero());
  tie_forces_.resize(inputs.ties.size());
}

void ConstraintSet::start(std::span<const ConstraintMemory> memory, const Inputs& inputs) {
  memory_.assign(memory.begin(), memory.end());
  contact_forces_.assign(inputs.contacts.size(), Eigen::Vector3d::Zero());
  tie_forces_.assign(inputs.ties.size(), BodyForce{});
  report_ = {};
  first_sub_step_ = steady_ = true;
}

void ConstraintSet::clear() {
  tree_.clear();
  blocks_.clear();
  limited_.clear();
}

template <class T>
void ConstraintSet::gather(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                           int copy) {
  clear();
  cursor_ = 0;
  const Inputs& inputs = *context.inputs;
  const Copy& run = context.copies[copy];
  for (std::size_t i = 0; i < inputs.contacts.size(); ++i) {
    if (inputs.contacts[i].body_a == inputs.contacts[i].body_b) continue;  // one rigid body
    tree_.touch(context, plan, nodes, copy, inputs.contacts[i].body_a);
    tree_.touch(context, plan, nodes, copy, inputs.contacts[i].body_b);
    add(contact_block(tree_, inputs.contacts[i], static_cast<int>(i), run.h, run.offset), run.h);
  }
  for (std::size_t i = 0; i < inputs.ties.size(); ++i) {
    if (inputs.ties[i].body_a == inputs.ties[i].body_b) continue;
    tree_.touch(context, plan, nodes, copy, inputs.ties[i].body_a);
    tree_.touch(context, plan, nodes, copy, inputs.ties[i].body_b);
    add(tie_block(tree_, inputs.ties[i], static_cast<int>(i), run.h), run.h);
    if (inputs.ties[i].holds_rotation) {
      add(tie_rotation_block(tree_, inputs.ties[i], static_cast<int>(i), run.h), run.h);
    }
  }
}

void ConstraintSet::renew() {
  tree_.renew();
  for (ConstraintBlock& block : blocks_) block.applied.setZero();
  solved_rows_ = kNone;
}

/// Impulse of the rows that exerted the remembered force. Rows mostly come in the order of the last time.
Eigen::Vector3d ConstraintSet::remembered(std::uint64_t key, double h, const Eigen::Matrix3d& directions) {
  for (std::size_t tried = 0; tried < memory_.size(); ++tried) {
    if (cursor_ >= memory_.size()) cursor_ = 0;
    const ConstraintMemory& memory = memory_[cursor_++];
    if (memory.key != key) continue;
    // A bound's direction need not be of unit length.
    const Eigen::Vector3d lengths = directions.colwise().squaredNorm().transpose();
    const Eigen::Vector3d impulse = h * (directions.transpose() * memory.force);
    return (lengths.array() > 0.0).select(impulse.array() / lengths.array(), 0.0);
  }
  return Eigen::Vector3d::Zero();
}

void ConstraintSet::add(ConstraintBlock&& block, double h) {
  block.impulse = remembered(block.key, h, block.directions);
  block.impulse.tail(3 - block.rows).setZero();
  block.active = block.kind != Kind::kContact || !block.impulse.isZero(0.0);
  blocks_.push_back(block);
}

/// Looks at the joints whose limits the velocities may reach.
template <class T>
void ConstraintSet::take_limits(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes,
                                int copy) {
  const Copy& run = context.copies[copy];
  for (LimitedJoint& joint : limited_) take_bounds(joint, context, plan, nodes, copy);
  for (const int body : plan.limited) {
    Node<T>& node = nodes[plan.schedule.slot_of(copy, body)];
    const int lane = plan.schedule.lane_of(copy, body);
    if (math::lane(node.slack, lane) >= run.h * math::lane(node.w_PB, lane).norm()) continue;
    const auto same = [body](const LimitedJoint& joint) { return joint.body == body; };
    if (std::any_of(limited_.begin(), limited_.end(), same)) continue;
    const JointLimits& limits = context.model->body(body).limits;
    const LimitState state = limit_state(limits, run.from[body].rotation);
    math::set_lane(node.slack, lane, state.slack);
    tree_.touch(context, plan, nodes, copy, body);
    const int carrier = tree_.at(body).parent;
    const Eigen::Quaterniond R_WC = carrier < 0 ? Eigen::Quaterniond::Identity() : tree_.at(carrier).rotation;
    const Eigen::Quaterniond R_WP = R_WC * math::lane(plan.constants[plan.schedule.slot_of(copy, body)].mount, lane);
    limited_.push_back({.body = body, .state = state, .axes = (R_WP * reference_axes(limits)).toRotationMatrix()});
    take_bounds(limited_.back(), context, plan, nodes, copy);
  }
}

template <class T>
void ConstraintSet::take_bounds(LimitedJoint& joint, const StepContext& context, const Plan<T>& plan,
                                const std::vector<Node<T>>& nodes, int copy) {
  const double h = context.copies[copy].h;
  for (int index = 0; index < LimitedJoint::kBounds; ++index) {
    const LimitState::Bound& bound = joint.bound(index);
    if (joint.taken[index] || !std::isfinite(bound.gap)) continue;
    const Node<T>& node = nodes[plan.schedule.slot_of(copy, joint.body)];
    const int lane = plan.schedule.lane_of(copy, joint.body);
    const Eigen::Vector3d w = lane_matrix(motion_of(node), lane) * math::lane(node.w_PB, lane);
    if (bound.gap + h * bound.direction.dot(joint.axes.transpose() * w) >= 0.0) continue;
    joint.taken[index] = true;
    add(limit_block(joint, index, h), h);
  }
}

template <class T>
Eigen::Vector3d ConstraintSet::row_velocity(const ConstraintBlock& block, const Plan<T>& plan,
                                            const std::vector<Node<T>>& nodes, int copy) const {
  const auto read = [&](int body, Vec3<T> Node<T>::*member) {
    return math::lane(nodes[plan.schedule.slot_of(copy, body)].*member, plan.schedule.lane_of(copy, body));
  };
  const Jacobian& jacobian = block.jacobian;
  if (jacobian.joint >= 0) {
    const int slot = plan.schedule.slot_of(copy, jacobian.joint);
    const Eigen::Matrix3d motion = lane_matrix(motion_of(nodes[slot]), plan.schedule.lane_of(copy, jacobian.joint));
    return jacobian.torque.transpose() * (motion * read(jacobian.joint, &Node<T>::w_PB));
  }
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (const Jacobian::Side* side : {&jacobian.a, &jacobian.b}) {
    if (side->body < 0) continue;
    velocity += side->moment.transpose() * read(side->body, &Node<T>::w_WB);
    velocity += side->force.transpose() * read(side->body, &Node<T>::v_WB);
  }
  return velocity;
}

/// Takes rows into the problem that the velocities violate. False if there are none.
bool ConstraintSet::activate() {
  const double tolerated = solved_rows_ == kNone ? 0.0 : kViolation;
  active_rows_ = 0;
  for (ConstraintBlock& block : blocks_) {
    if (!block.active) block.active = block.velocity[0] + block.bias[0] < -tolerated;
    if (block.active) active_rows_ += block.rows;
  }
  return active_rows_ != std::max(solved_rows_, 0);
}

/// The Delassus matrix and b of the active rows. `velocity` holds what has been applied already.
void ConstraintSet::assemble() {
  laws_.clear();
  tree_.begin(active_rows_);
  bias_.assign(active_rows_, 0.0);
  impulses_.assign(active_rows_, 0.0);
  int row = 0;
  for (ConstraintBlock& block : blocks_) {
    if (!block.active) continue;
    block.first = row;
    tree_.add(block.jacobian, row, block.rows);
    for (int k = 0; k < block.rows; ++k, ++row) {
      laws_.push_back(block.laws[k]);
      bias_[row] = block.velocity[k] + block.bias[k];
      impulses_[row] = block.applied[k];
    }
  }
  Eigen::Map<Eigen::MatrixXd> delassus = tree_.matrix();
  Eigen::Map<Eigen::VectorXd> bias(bias_.data(), active_rows_);
  const Eigen::Map<Eigen::VectorXd> applied(impulses_.data(), active_rows_);
  if (solved_rows_ > 0) bias.noalias() -= delassus.selfadjointView<Eigen::Lower>() * applied;
  for (const ConstraintBlock& block : blocks_) {
    if (!block.active) continue;
    for (int k = 0; k < block.rows; ++k) delassus(block.first + k, block.first + k) += block.compliance[k];
  }
}

void ConstraintSet::solve_rows() {
  for (const ConstraintBlock& block : blocks_) {
    if (!block.active) continue;
    for (int k = 0; k < block.rows; ++k) impulses_[block.first + k] = block.impulse[k];
  }
  const Eigen::Map<Eigen::VectorXd> bias(bias_.data(), active_rows_);
  Eigen::Map<Eigen::VectorXd> impulses(impulses_.data(), active_rows_);
  largest_speed_ = bias.cwiseAbs().maxCoeff();
  const LcpReport solved = solve_lcp(tree_.matrix(), bias, laws_, impulses, lcp_);
  report_.rows = active_rows_;
  report_.iterations = std::max(report_.iterations, solved.iterations);
  if (solved.status != LcpStatus::kSolved) ++report_.unsolved;
  if (solved.residual >= report_.residual) {
    report_.residual = solved.residual;
    report_.status = solved.status;
  }
  for (ConstraintBlock& block : blocks_) {
    if (!block.active) continue;
    for (int k = 0; k < block.rows; ++k) {
      block.impulse[k] = impulses[block.first + k];
      impulses[block.first + k] -= block.applied[k];
    }
    block.applied = block.impulse;
  }
}

template <class T>
bool ConstraintSet::solve(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int copy) {
  take_limits(context, plan, nodes, copy);
  measure(plan, nodes, copy);
  if (!activate()) return false;
  tree_.read_factors(plan, nodes);
  assemble();
  solve_rows();
  solved_rows_ = active_rows_;
  tree_.apply(Eigen::Map<Eigen::VectorXd>(impulses_.data(), active_rows_), nodes);
  return true;
}

template <class T>
void ConstraintSet::measure(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy) {
  for (ConstraintBlock& block : blocks_) block.velocity = row_velocity(block, plan, nodes, copy);
}

double ConstraintSet::slope(double fraction) const {
  double sum = 0.0;
  for (const ConstraintBlock& block : blocks_) {
    const bool one_sided = block.kind == Kind::kContact || block.kind == Kind::kLimit;
    if (!block.active || !one_sided) continue;
    const double impulse = block.accepted_impulse[0] + fraction * (block.impulse[0] - block.accepted_impulse[0]);
    sum += impulse * (block.velocity[0] - block.accepted_velocity[0]);
  }
  return sum;
}

void ConstraintSet::accept(double fraction, bool first) {
  for (ConstraintBlock& block : blocks_) {
    if (first) {
      block.accepted_impulse = block.impulse;
      block.accepted_velocity = block.velocity;
    } else {
      block.accepted_impulse += fraction * (block.impulse - block.accepted_impulse);
      block.accepted_velocity += fraction * (block.velocity - block.accepted_velocity);
    }
  }
}

template <class T>
void ConstraintSet::finish(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                           int copy) {
  Copy& run = context.copies[copy];
  memory_.clear();
  report_.acting = 0;
  std::fill(contact_forces_.begin(), contact_forces_.end(), Eigen::Vector3d::Zero());
  std::fill(tie_forces_.begin(), tie_forces_.end(), BodyForce{});
  std::uint64_t pattern = 0;
  for (const ConstraintBlock& block : blocks_) {
    if (!block.active || block.impulse.isZero(0.0)) continue;
    const Eigen::Vector3d force = block.directions * block.impulse / run.h;
    const Eigen::Vector3d velocity = row_velocity(block, plan, nodes, copy);
    run.work.constraints -= block.impulse.dot(velocity);
    // The answer's velocities are those of the laws to a part of the largest one, and positions have the rounding of
    // their size.
    run.work.rounding +=
        block.impulse.norm() * (kLcpTolerance * largest_speed_ + kPositionRounding * block.reach / run.h);
    memory_.push_back({.key = block.key, .force = force});
    ++report_.acting;
    if (block.kind == Kind::kContact) contact_forces_[block.source] = force;
    if (block.kind == Kind::kTie) tie_forces_[block.source].force = force;
    if (block.kind == Kind::kTieRotation) tie_forces_[block.source].torque = force;
    const double held = block.rows == 3 ? block.laws[0].friction * block.impulse[0] * kSliding : 0.0;
    const bool slides = block.kind == Kind::kContact && block.impulse.tail<2>().norm() > held;
    pattern = mixed(pattern, 2 * block.key + (slides ? 1 : 0));
  }
  steady_ = steady_ && (first_sub_step_ || pattern == pattern_);
  pattern_ = pattern;
  first_sub_step_ = false;
}

#define LAYFIGURE_INSTANTIATE(T)                                                                             \
  template void ConstraintSet::gather(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&, int); \
  template bool ConstraintSet::solve(const StepContext&, const Plan<T>&, std::vector<Node<T>>&, int);        \
  template void ConstraintSet::measure(const Plan<T>&, const std::vector<Node<T>>&, int);                    \
  template void ConstraintSet::finish(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&, int);
LAYFIGURE_INSTANTIATE(double)
LAYFIGURE_INSTANTIATE(math::Lanes4)
#undef LAYFIGURE_INSTANTIATE

}  // namespace layfigure::dynamics
