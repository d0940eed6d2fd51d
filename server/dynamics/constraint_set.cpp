#include "constraint_set.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "lane_transfer.h"
#include "layfigure/math/scrambled.h"

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

/// Contacts in their order, which is that of the bodies, then ties, then limits: rows that have to do with each other
/// are near each other, which the solver makes use of (lcp_factor.h).
bool comes_before(const ConstraintBlock& a, const ConstraintBlock& b) {
  const auto place = [](const ConstraintBlock& block) {
    const int group = block.kind == Kind::kContact ? 0 : block.kind == Kind::kLimit ? 2 : 1;
    return std::tuple(group, block.source, block.key);
  };
  return place(a) < place(b);
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
  watched_.clear();
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
    if (recall(block_key(inputs.contacts[i])) != nullptr) {
      add(contact_block(tree_, inputs.contacts[i], static_cast<int>(i), run.h, run.offset), run.h);
    } else {
      watched_.push_back(contact_watch(tree_, inputs.contacts[i], static_cast<int>(i), run.h, run.offset));
    }
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

/// What the last sub-step remembers of such rows; nullptr: nothing. Rows mostly come in the order of the last time.
const ConstraintMemory* ConstraintSet::recall(std::uint64_t key) {
  for (std::size_t tried = 0; tried < memory_.size(); ++tried) {
    if (cursor_ >= memory_.size()) cursor_ = 0;
    if (memory_[cursor_].key == key) return &memory_[cursor_];
    ++cursor_;
  }
  return nullptr;
}

/// Adds a block to the problem, with the impulse of the force that it exerted last.
void ConstraintSet::add(ConstraintBlock&& block, double h) {
  const ConstraintMemory* memory = recall(block.key);
  if (memory != nullptr) {
    // A bound's direction need not be of unit length.
    const Eigen::Vector3d lengths = block.directions.colwise().squaredNorm().transpose();
    const Eigen::Vector3d impulse = h * (block.directions.transpose() * memory->force);
    block.impulse = (lengths.array() > 0.0).select(impulse.array() / lengths.array(), 0.0);
  }
  block.impulse.tail(3 - block.rows).setZero();
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

template <class T>
double ConstraintSet::normal_velocity(const ContactWatch& watch, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                                      int copy) const {
  const auto of = [&](int body, const Eigen::Vector3d& moment, double side) {
    if (body < 0) return 0.0;
    const Node<T>& node = nodes[plan.schedule.slot_of(copy, body)];
    const int lane = plan.schedule.lane_of(copy, body);
    return moment.dot(math::lane(node.w_WB, lane)) + side * watch.normal.dot(math::lane(node.v_WB, lane));
  };
  return of(watch.body_a, watch.moment_a, 1.0) + of(watch.body_b, watch.moment_b, -1.0);
}

/// Takes the contacts into the problem that the velocities violate. False if it is the one that has been solved.
template <class T>
bool ConstraintSet::activate(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                             int copy) {
  const Copy& run = context.copies[copy];
  const double tolerated = solved_rows_ == kNone ? 0.0 : kViolation;
  std::size_t left = 0;
  for (const ContactWatch& watch : watched_) {
    if (!(watch.velocity + watch.bias < -tolerated)) {
      watched_[left++] = watch;
      continue;
    }
    add(contact_block(tree_, context.inputs->contacts[watch.source], watch.source, run.h, run.offset), run.h);
    blocks_.back().velocity = row_velocity(blocks_.back(), plan, nodes, copy);
    blocks_.back().accepted_velocity = watch.accepted_velocity;
  }
  if (left < watched_.size()) std::sort(blocks_.begin(), blocks_.end(), comes_before);
  watched_.erase(watched_.begin() + static_cast<std::ptrdiff_t>(left), watched_.end());
  rows_ = 0;
  for (const ConstraintBlock& block : blocks_) rows_ += block.rows;
  return rows_ != std::max(solved_rows_, 0);
}

/// The Delassus matrix and b of the rows. `velocity` holds what has been applied already.
void ConstraintSet::assemble() {
  laws_.clear();
  tree_.begin(rows_);
  bias_.assign(rows_, 0.0);
  impulses_.assign(rows_, 0.0);
  int row = 0;
  for (ConstraintBlock& block : blocks_) {
    block.first = row;
    tree_.add(block.jacobian, row, block.rows);
    for (int k = 0; k < block.rows; ++k, ++row) {
      laws_.push_back(block.laws[k]);
      bias_[row] = block.velocity[k] + block.bias[k];
      impulses_[row] = block.applied[k];
    }
  }
  Eigen::Map<Eigen::MatrixXd> delassus = tree_.matrix();
  Eigen::Map<Eigen::VectorXd> bias(bias_.data(), rows_);
  const Eigen::Map<Eigen::VectorXd> applied(impulses_.data(), rows_);
  if (solved_rows_ > 0) bias.noalias() -= delassus.selfadjointView<Eigen::Lower>() * applied;
  for (const ConstraintBlock& block : blocks_) {
    for (int k = 0; k < block.rows; ++k) delassus(block.first + k, block.first + k) += block.compliance[k];
  }
}

void ConstraintSet::solve_rows() {
  for (const ConstraintBlock& block : blocks_) {
    for (int k = 0; k < block.rows; ++k) impulses_[block.first + k] = block.impulse[k];
  }
  const Eigen::Map<Eigen::VectorXd> bias(bias_.data(), rows_);
  Eigen::Map<Eigen::VectorXd> impulses(impulses_.data(), rows_);
  largest_speed_ = bias.cwiseAbs().maxCoeff();
  const LcpReport solved = solve_lcp(tree_.matrix(), bias, laws_, impulses, lcp_);
  report_.rows = rows_;
  report_.iterations = std::max(report_.iterations, solved.iterations);
  if (solved.status != LcpStatus::kSolved) ++report_.unsolved;
  if (solved.residual >= report_.residual) {
    report_.residual = solved.residual;
    report_.status = solved.status;
  }
  for (ConstraintBlock& block : blocks_) {
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
  if (!activate(context, plan, nodes, copy)) return false;
  tree_.read_factors(plan, nodes);
  assemble();
  solve_rows();
  solved_rows_ = rows_;
  tree_.apply(Eigen::Map<Eigen::VectorXd>(impulses_.data(), rows_), nodes);
  return true;
}

template <class T>
void ConstraintSet::measure(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy) {
  for (ConstraintBlock& block : blocks_) block.velocity = row_velocity(block, plan, nodes, copy);
  for (ContactWatch& watch : watched_) watch.velocity = normal_velocity(watch, plan, nodes, copy);
}

double ConstraintSet::slope(double fraction) const {
  double sum = 0.0;
  for (const ConstraintBlock& block : blocks_) {
    if (block.kind != Kind::kContact && block.kind != Kind::kLimit) continue;
    const double impulse = block.accepted_impulse + fraction * (block.impulse[0] - block.accepted_impulse);
    sum += impulse * (block.velocity[0] - block.accepted_velocity);
  }
  return sum;
}

void ConstraintSet::accept(double fraction, bool first) {
  const auto move = [&](double now, double& accepted) {
    accepted = first ? now : accepted + fraction * (now - accepted);
  };
  for (ConstraintBlock& block : blocks_) {
    move(block.impulse[0], block.accepted_impulse);
    move(block.velocity[0], block.accepted_velocity);
  }
  for (ContactWatch& watch : watched_) move(watch.velocity, watch.accepted_velocity);
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
    if (block.impulse.isZero(0.0)) continue;
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
    pattern += math::scrambled(2 * block.key + (slides ? 1 : 0));  // in whatever order they were taken in
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
