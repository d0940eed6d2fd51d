#include "constraint_rows.h"

#include <algorithm>
#include <cmath>

#include "layfigure/math/rotation.h"

namespace layfigure::dynamics {
namespace {

using Kind = ConstraintBlock::Kind;

constexpr double kAngle = 1.0;  // size of rotations [rad]

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
    const double duration = std::max(h + kRecoveryTime, x.norm() / largest_speed);
    return {.compliance = 0.0, .bias = x / duration};
  }
  const double resistance = h * K + B;
  return {.compliance = 1.0 / (h * resistance), .bias = x * (K / resistance)};
}

std::array<LcpRow, 3> laws_within(double most) {
  const LcpRow law = LcpRow::box(-most, most);
  return {law, law, law};
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

/// b of a contact's normal row between two points.
double normal_bias(const Contact& contact, const Anchor& a, const Anchor& b, double h, double offset) {
  const double surface = contact.normal.dot(contact.surface_velocity);
  const double gap = contact.normal.dot(a.position - b.position) - surface * offset;
  return unilateral_bias(gap, h) - surface;
}

}  // namespace

const LimitState::Bound& LimitedJoint::bound(int index) const {
  return index == 0 ? state.lower_twist : index == 1 ? state.upper_twist : state.swing;
}

ConstraintBlock contact_block(const PathTree& tree, const Contact& contact, int index, double h, double offset) {
  const Anchor a = anchor_of(tree, contact.body_a, contact.point_a);
  const Anchor b = anchor_of(tree, contact.body_b, contact.point_b);
  const Eigen::Matrix3d frame = contact_frame(contact.normal);
  const bool rough = contact.friction > 0.0;
  ConstraintBlock block{
      .kind = Kind::kContact,
      .key = block_key(contact),
      .source = index,
      .rows = rough ? 3 : 1,
      .laws = {rough ? LcpRow::contact(contact.friction) : LcpRow::unilateral(), LcpRow::tangent(), LcpRow::tangent()},
      .jacobian = {.a = side_at(contact.body_a, a.r, frame), .b = side_at(contact.body_b, b.r, -frame)},
      .directions = frame,
      .bias = -(frame.transpose() * contact.surface_velocity),
      .compliance = Eigen::Vector3d::Zero(),
      .reach = a.position.norm()};
  block.bias[0] = normal_bias(contact, a, b, h, offset);
  return block;
}

ContactWatch contact_watch(const PathTree& tree, const Contact& contact, int index, double h, double offset) {
  const Anchor a = anchor_of(tree, contact.body_a, contact.point_a);
  const Anchor b = anchor_of(tree, contact.body_b, contact.point_b);
  return {.source = index,
          .body_a = contact.body_a,
          .body_b = contact.body_b,
          .normal = contact.normal,
          .moment_a = a.r.cross(contact.normal),
          .moment_b = -b.r.cross(contact.normal),
          .bias = normal_bias(contact, a, b, h, offset)};
}

std::uint64_t block_key(const Contact& contact) { return block_key(Kind::kContact, contact.key); }

ConstraintBlock tie_block(const PathTree& tree, const Tie& tie, int index, double h) {
  const Anchor a = anchor_of(tree, tie.body_a, tie.point_a);
  const Anchor b = anchor_of(tree, tie.body_b, tie.point_b);
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const Spring spring = spring_rows(tie.stiffness, tie.damping, h, a.position - b.position, kLargestClosingSpeed);
  return {.kind = Kind::kTie,
          .key = block_key(Kind::kTie, index),
          .source = index,
          .rows = 3,
          .laws = laws_within(h * tie.max_force),
          .jacobian = {.a = side_at(tie.body_a, a.r, axes), .b = side_at(tie.body_b, b.r, -axes)},
          .directions = axes,
          .bias = spring.bias,
          .compliance = Eigen::Vector3d::Constant(spring.compliance),
          .reach = a.position.norm()};
}

ConstraintBlock tie_rotation_block(const PathTree& tree, const Tie& tie, int index, double h) {
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const Eigen::Quaterniond R_WB = tie.body_b == kWorld ? Eigen::Quaterniond::Identity() : tree.at(tie.body_b).rotation;
  const Eigen::Vector3d turn = math::log_rotation(tree.at(tie.body_a).rotation * (R_WB * tie.rotation).conjugate());
  const Spring spring = spring_rows(tie.angular_stiffness, tie.angular_damping, h, turn, kLargestClosingSpin);
  return {.kind = Kind::kTieRotation,
          .key = block_key(Kind::kTieRotation, index),
          .source = index,
          .rows = 3,
          .laws = laws_within(h * tie.max_torque),
          .jacobian = {.a = side_of_moment(tie.body_a, axes), .b = side_of_moment(tie.body_b, -axes)},
          .directions = axes,
          .bias = spring.bias,
          .compliance = Eigen::Vector3d::Constant(spring.compliance),
          .reach = kAngle};
}

ConstraintBlock limit_block(const LimitedJoint& joint, int index, double h) {
  const LimitState::Bound& bound = joint.bound(index);
  Eigen::Matrix3d torque = Eigen::Matrix3d::Zero();
  torque.col(0) = joint.axes * bound.direction;
  return {.kind = Kind::kLimit,
          .key = block_key(Kind::kLimit, LimitedJoint::kBounds * joint.body + index),
          .source = joint.body,
          .rows = 1,
          .laws = {LcpRow::unilateral(), LcpRow::tangent(), LcpRow::tangent()},
          .jacobian = {.a = {}, .b = {}, .joint = joint.body, .torque = torque},
          .directions = torque,
          .bias = {unilateral_bias(bound.gap, h), 0.0, 0.0},
          .compliance = Eigen::Vector3d::Zero(),
          .reach = kAngle};
}

}  // namespace layfigure::dynamics
