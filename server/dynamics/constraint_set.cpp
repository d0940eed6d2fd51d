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
// Friction that uses this much of its cone slides.
constexpr double kSliding = 1.0 - 1e-9;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& r) {
  Eigen::Matrix3d m;
  m << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
  return m;
}

/// [n t1 t2], right-handed, with tangents that depend on the normal alone.
Eigen::Matrix3d contact_frame(const Eigen::Vector3d& n) {
  const Eigen::Vector3d other = std::abs(n.x()) < 0.6 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  Eigen::Matrix3d frame;
  frame.col(0) = n;
  frame.col(1) = n.cross(other).normalized();
  frame.col(2) = n.cross(frame.col(1));
  return frame;
}

/// b of a rigid unilateral row of gap x.
double unilateral_bias(double gap, double h) { return gap >= 0.0 ? gap / h : gap / (h + kRecoveryTime); }

struct Spring {
  double compliance;     ///< S
  Eigen::Vector3d bias;  ///< b
};

/// Rows that close the gap x.
Spring spring_rows(double K, double B, double h, const Eigen::Vector3d& x, double largest_speed) {
  if (!std::isfinite(K)) {
    return {.compliance = 0.0, .bias = x * std::min(1.0 / h, largest_speed / std::max(x.norm(), h * largest_speed))};
  }
  const double resistance = h * K + B;
  return {.compliance = 1.0 / (h * resistance), .bias = x * (K / resistance)};
}

Jacobian::Side side_at(int body, const Eigen::Vector3d& r, const Eigen::Matrix3d& forces) {
  return {.body = body, .moment = cross_matrix(r) * forces, .force = forces};
}

Jacobian::Side side_of_moment(int body, const Eigen::Matrix3d& moments) {
  return {.body = body, .moment = moments, .force = Eigen::Matrix3d::Zero()};
}

/// A point of a body, or of the world.
struct Anchor {
  Eigen::Vector3d r;  ///< from the body's origin, world axes
  Eigen::Vector3d position;
};

Anchor anchor_of(const PathTree& tree, int body, const Eigen::Vector3d& point) {
  if (body == kWorld) return {.r = Eigen::Vector3d::Zero(), .position = point};
  const PathNode& node = tree.at(body);
  const Eigen::Vector3d r = node.rotation * point;
  return {.r = r, .position = node.origin + r};
}

std::uint64_t block_key(Kind kind, std::uint64_t source) { return (source << 2) | static_cast<std::uint64_t>(kind); }

std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  return (hash ^ value) * 0x9e3779b97f4a7c15ULL + (hash >> 29);
}

const LimitState::Bound& bound_of(const LimitState& state, int index) {
  return index == 0 ? state.lower_twist : index == 1 ? state.upper_twist : state.swing;
}

}  // namespace

void ConstraintSet::reserve(int bodies) { tree_.reserve(bodies); }

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
    tree_.touch(context, plan, nodes, copy, inputs.contacts[i].body_a);
    tree_.touch(context, plan, nodes, copy, inputs.contacts[i].body_b);
    add_contact(inputs.contacts[i], static_cast<int>(i), run.h, run.offset);
  }
  for (std::size_t i = 0; i < inputs.ties.size(); ++i) {
    tree_.touch(context, plan, nodes, copy, inputs.ties[i].body_a);
    tree_.touch(context, plan, nodes, copy, inputs.ties[i].body_b);
    add_tie(inputs.ties[i], static_cast<int>(i), run.h);
  }
}

template <class T>
void ConstraintSet::renew(const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  tree_.refresh(plan, nodes);
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

void ConstraintSet::add(ConstraintBlock block, double h) {
  block.impulse = remembered(block.key, h, block.directions);
  block.impulse.tail(3 - block.rows).setZero();
  block.active = block.kind != Kind::kContact || !block.impulse.isZero(0.0);
  blocks_.push_back(block);
}

void ConstraintSet::add_contact(const Contact& contact, int index, double h, double offset) {
  const Anchor a = anchor_of(tree_, contact.body_a, contact.point_a);
  const Anchor b = anchor_of(tree_, contact.body_b, contact.point_b);
  const Eigen::Matrix3d frame = contact_frame(contact.normal);
  const Eigen::Vector3d surface = frame.transpose() * contact.surface_velocity;
  const double gap = contact.normal.dot(a.position - b.position) - surface[0] * offset;
  const bool rough = contact.friction > 0.0;
  ConstraintBlock block{
      .kind = Kind::kContact,
      .key = block_key(Kind::kContact, contact.key),
      .source = index,
      .rows = rough ? 3 : 1,
      .laws = {rough ? LcpRow::contact(contact.friction) : LcpRow::unilateral(), LcpRow::tangent(), LcpRow::tangent()},
      .jacobian = {.a = side_at(contact.body_a, a.r, frame), .b = side_at(contact.body_b, b.r, -frame)},
      .directions = frame,
      .bias = -surface,
      .compliance = Eigen::Vector3d::Zero()};
  block.bias[0] += unilateral_bias(gap, h);
  add(block, h);
}

void ConstraintSet::add_tie(const Tie& tie, int index, double h) {
  const Anchor a = anchor_of(tree_, tie.body_a, tie.point_a);
  const Anchor b = anchor_of(tree_, tie.body_b, tie.point_b);
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const auto laws_within = [](double most) {
    const LcpRow law = LcpRow::box(-most, most);
    return std::array<LcpRow, 3>{law, law, law};
  };
  const Spring spring = spring_rows(tie.stiffness, tie.damping, h, a.position - b.position, kLargestClosingSpeed);
  add({.kind = Kind::kTie,
       .key = block_key(Kind::kTie, index),
       .source = index,
       .rows = 3,
       .laws = laws_within(h * tie.max_force),
       .jacobian = {.a = side_at(tie.body_a, a.r, axes), .b = side_at(tie.body_b, b.r, -axes)},
       .directions = axes,
       .bias = spring.bias,
       .compliance = Eigen::Vector3d::Constant(spring.compliance)},
      h);
  if (!tie.holds_rotation) return;
  const Eigen::Quaterniond R_WB = tie.body_b == kWorld ? Eigen::Quaterniond::Identity() : tree_.at(tie.body_b).rotation;
  const Eigen::Vector3d turn = math::log_rotation(tree_.at(tie.body_a).rotation * (R_WB * tie.rotation).conjugate());
  const Spring angular = spring_rows(tie.angular_stiffness, tie.angular_damping, h, turn, kLargestClosingSpin);
  add({.kind = Kind::kTieRotation,
       .key = block_key(Kind::kTieRotation, index),
       .source = index,
       .rows = 3,
       .laws = laws_within(h * tie.max_torque),
       .jacobian = {.a = side_of_moment(tie.body_a, axes), .b = side_of_moment(tie.body_b, -axes)},
       .directions = axes,
       .bias = angular.bias,
       .compliance = Eigen::Vector3d::Constant(angular.compliance)},
      h);
}

void ConstraintSet::add_limit(Limited& joint, int index, double h) {
  const LimitState::Bound& bound = bound_of(joint.state, index);
  joint.taken[index] = true;
  Eigen::Matrix3d torque = Eigen::Matrix3d::Zero();
  torque.col(0) = joint.axes * bound.direction;
  add({.kind = Kind::kLimit,
       .key = block_key(Kind::kLimit, 3 * joint.body + index),
       .source = joint.body,
       .rows = 1,
       .laws = {LcpRow::unilateral(), LcpRow::tangent(), LcpRow::tangent()},
       .jacobian = {.a = {}, .b = {}, .joint = joint.body, .torque = torque},
       .directions = torque,
       .bias = {unilateral_bias(bound.gap, h), 0.0, 0.0},
       .compliance = Eigen::Vector3d::Zero()},
      h);
}

/// Looks at the joints whose limits the velocities may reach.
template <class T>
void ConstraintSet::take_limits(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes,
                                int copy) {
  const Copy& run = context.copies[copy];
  for (Limited& joint : limited_) take_bounds(joint, context, plan, nodes, copy);
  for (const int body : plan.limited) {
    Node<T>& node = nodes[plan.schedule.slot_of(copy, body)];
    const int lane = plan.schedule.lane_of(copy, body);
    if (math::lane(node.slack, lane) >= run.h * math::lane(node.w_PB, lane).norm()) continue;
    const auto same = [body](const Limited& joint) { return joint.body == body; };
    if (std::any_of(limited_.begin(), limited_.end(), same)) continue;
    const JointLimits& limits = context.model->body(body).limits;
    const LimitState state = limit_state(limits, run.from[body].rotation);
    math::set_lane(node.slack, lane, state.slack);
    tree_.touch(context, plan, nodes, copy, body);
    const int parent = tree_.at(body).parent;
    const Eigen::Quaterniond R_WP = parent < 0 ? Eigen::Quaterniond::Identity() : tree_.at(parent).rotation;
    limited_.push_back({.body = body, .state = state, .axes = (R_WP * reference_axes(limits)).toRotationMatrix()});
    take_bounds(limited_.back(), context, plan, nodes, copy);
  }
}

template <class T>
void ConstraintSet::take_bounds(Limited& joint, const StepContext& context, const Plan<T>& plan,
                                const std::vector<Node<T>>& nodes, int copy) {
  const double h = context.copies[copy].h;
  for (int index = 0; index < 3; ++index) {
    const LimitState::Bound& bound = bound_of(joint.state, index);
    if (joint.taken[index] || !std::isfinite(bound.gap)) continue;
    const Node<T>& node = nodes[plan.schedule.slot_of(copy, joint.body)];
    const int lane = plan.schedule.lane_of(copy, joint.body);
    const Eigen::Vector3d w = lane_matrix(node.axes, lane) * math::lane(node.w_PB, lane);
    if (bound.gap + h * bound.direction.dot(joint.axes.transpose() * w) < 0.0) add_limit(joint, index, h);
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
    const Eigen::Matrix3d axes = lane_matrix(nodes[slot].axes, plan.schedule.lane_of(copy, jacobian.joint));
    return jacobian.torque.transpose() * (axes * read(jacobian.joint, &Node<T>::w_PB));
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
  const LcpReport solved = solve_lcp(tree_.matrix(), bias, laws_, impulses, lcp_);
  report_.rows = active_rows_;
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
    run.work.constraints -= block.impulse.dot(row_velocity(block, plan, nodes, copy));
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
  template void ConstraintSet::renew(const Plan<T>&, const std::vector<Node<T>>&);                           \
  template bool ConstraintSet::solve(const StepContext&, const Plan<T>&, std::vector<Node<T>>&, int);        \
  template void ConstraintSet::measure(const Plan<T>&, const std::vector<Node<T>>&, int);                    \
  template void ConstraintSet::finish(const StepContext&, const Plan<T>&, const std::vector<Node<T>>&, int);
LAYFIGURE_INSTANTIATE(double)
LAYFIGURE_INSTANTIATE(math::Lanes4)
#undef LAYFIGURE_INSTANTIATE

}  // namespace layfigure::dynamics
