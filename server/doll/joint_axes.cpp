#include "joint_axes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace layfigure::doll {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRadian = std::numbers::pi / 180.0;

// The elbow's carrying angle and the knee's valgus, which are no bends, stay below 20 degrees.
constexpr double kVisibleBend = 20.0 * kRadian;
// A direction this near to the limb's own says nothing about how the limb bends.
constexpr double kLeastAcross = 15.0 * kRadian;
// The share of a foot's length that points forward, for it to tell where that is.
constexpr double kLeastForward = 0.2;
// The axis of the upper arm's cone: near to the plane of hanging and straight out, between which a twist then hardly
// changes, and so that the cone's rim, its widths in range_of_motion.cpp, comes near to six directions that AAOS gives.
constexpr double kConeForward = 20.0 * kRadian;
constexpr double kConeDown = 40.0 * kRadian;

Vector3d turned(const Vector3d& from, const Vector3d& to, const Vector3d& direction) {
  return Quaterniond::FromTwoVectors(from, to) * direction;
}

Vector3d across(const Vector3d& direction, const Vector3d& axis) { return direction - axis.dot(direction) * axis; }

/// Columns x, y = x cross f, x cross y.
std::optional<Matrix3d> frame(const Vector3d& x, const Vector3d& f) {
  const Vector3d y = x.cross(f);
  if (!(y.norm() > std::sin(kLeastAcross) * f.norm())) return std::nullopt;
  Matrix3d axes;
  axes << x, y.normalized(), x.cross(y.normalized());
  return axes;
}

/// Knows the character, and answers for its bodies.
class Anatomy {
 public:
  Anatomy(const BodyLayout& layout, const Mirror& mirror, const BodyAxes& axes)
      : layout_(layout), mirror_(mirror), axes_(axes) {}

  [[nodiscard]] std::optional<JointAxes> joint(int b) const;

 private:
  struct Palm {
    Vector3d normal;  ///< away from the palm
    Vector3d thumb;   ///< from the little finger to the index finger
  };

  [[nodiscard]] Vector3d limb(int b) const { return limb_direction(layout_, b); }
  [[nodiscard]] Vector3d outward(int b) const;
  [[nodiscard]] std::optional<Vector3d> bend(int b) const;
  [[nodiscard]] std::optional<Vector3d> bend_below(int b) const;
  [[nodiscard]] Vector3d elbow_bends_to(int forearm) const;
  [[nodiscard]] Vector3d knee_bends_to(int shin) const;
  [[nodiscard]] std::optional<Palm> palm(int b) const;
  [[nodiscard]] Vector3d thumb_side(int hand) const;

  [[nodiscard]] std::optional<JointAxes> from_bind(int b, const Vector3d& f, const Vector3d& a) const;
  [[nodiscard]] std::optional<JointAxes> from_bind_in_middle(const Vector3d& x, const Vector3d& f) const;
  [[nodiscard]] std::optional<JointAxes> in_line(int b, const Vector3d& f, const Vector3d& a) const;
  [[nodiscard]] std::optional<JointAxes> upper_arm(int b) const;
  [[nodiscard]] std::optional<JointAxes> thigh(int b) const;
  [[nodiscard]] std::optional<JointAxes> finger(int b) const;

  const BodyLayout& layout_;
  const Mirror& mirror_;
  const BodyAxes& axes_;
};

Vector3d Anatomy::outward(int b) const {
  return mirror_.normal.dot(layout_[b].com) < mirror_.offset ? Vector3d(-mirror_.normal) : mirror_.normal;
}

/// The axis that a visibly bent joint bends about.
std::optional<Vector3d> Anatomy::bend(int b) const {
  const int above = limb_above(layout_, b);
  if (above < 0) return std::nullopt;
  const Vector3d axis = limb(above).cross(limb(b));
  const bool bent = std::atan2(axis.norm(), limb(above).dot(limb(b))) > kVisibleBend && axis.norm() > 0.0;
  return bent ? std::optional(axis.normalized()) : std::nullopt;
}

/// The same of the joint at the end of `b`.
std::optional<Vector3d> Anatomy::bend_below(int b) const {
  for (int c = b + 1; c < static_cast<int>(layout_.size()); ++c) {
    if (layout_[c].parent == b && continues(layout_[b].name, layout_[c].name)) return bend(c);
  }
  return std::nullopt;
}

Vector3d Anatomy::elbow_bends_to(int forearm) const {
  if (const auto axis = bend(forearm)) return axis->cross(limb(forearm));
  const int above = limb_above(layout_, forearm);
  return turned(outward(forearm), limb(above < 0 ? forearm : above), axes_.forward);
}

Vector3d Anatomy::knee_bends_to(int shin) const {
  if (const auto axis = bend(shin)) return axis->cross(limb(shin));
  const int above = limb_above(layout_, shin);
  return turned(-axes_.up, limb(above < 0 ? shin : above), -axes_.forward);
}

/// Where the thumb is, seen from the hand.
Vector3d Anatomy::thumb_side(int hand) const {
  int first = -1;
  int last = -1;
  int thumb = -1;
  for (int b = hand + 1; b < static_cast<int>(layout_.size()); ++b) {
    const BoneName& name = layout_[b].name;
    if (!is_finger(name.part) || name.segment != 1 || nearest_above(layout_, b, BonePart::kHand) != hand) continue;
    if (name.part == BonePart::kThumb) {
      thumb = b;
      continue;
    }
    if (first < 0 || name.part < layout_[first].name.part) first = b;
    if (last < 0 || name.part > layout_[last].name.part) last = b;
  }
  if (first != last) return layout_[first].joint - layout_[last].joint;
  if (thumb >= 0) return layout_[thumb].com - layout_[hand].joint;
  const int forearm = nearest_above(layout_, hand, BonePart::kForearm);
  return forearm < 0 ? axes_.forward : elbow_bends_to(forearm);
}

/// Of the hand that `b` is of.
std::optional<Anatomy::Palm> Anatomy::palm(int b) const {
  const int hand = nearest_above(layout_, b, BonePart::kHand);
  if (hand < 0) return std::nullopt;
  const std::optional<Matrix3d> axes = frame(limb(hand), thumb_side(hand));
  if (!axes) return std::nullopt;
  // Fingers straight out to the left and the thumb forward, the palm is down.
  const double side = outward(hand).dot(axes_.left) < 0.0 ? -1.0 : 1.0;
  return Palm{side * axes->col(1), -axes->col(2)};
}

std::optional<JointAxes> Anatomy::from_bind(int b, const Vector3d& f, const Vector3d& a) const {
  const auto axes = frame(limb(b), f);
  return axes ? std::optional(JointAxes{*axes, *axes, a}) : std::nullopt;
}

/// A limb along `x`, as if it lay in the plane of the mirror.
std::optional<JointAxes> Anatomy::from_bind_in_middle(const Vector3d& x, const Vector3d& f) const {
  const Vector3d along = across(x, axes_.left);
  if (!(along.norm() > std::sin(kLeastAcross))) return std::nullopt;
  const auto axes = frame(along.normalized(), f);
  return axes ? std::optional(JointAxes{*axes, *axes, axes_.left}) : std::nullopt;
}

/// A bent joint bends about its own axis. It is neutral when its flexion is undone.
std::optional<JointAxes> Anatomy::in_line(int b, const Vector3d& f, const Vector3d& a) const {
  const auto axes = frame(limb(b), f);
  const int above = limb_above(layout_, b);
  if (!axes || above < 0) return from_bind(b, f, a);
  const Vector3d x = axes->col(0);
  const Vector3d y = axes->col(1);
  const Vector3d straight = across(limb(above), y);
  const double flexion = std::atan2(y.dot(straight.cross(x)), straight.dot(x));
  return JointAxes{*axes, Eigen::AngleAxisd(-flexion, y) * *axes, a};
}

std::optional<JointAxes> Anatomy::upper_arm(int b) const {
  const Vector3d out = outward(b);
  const Vector3d level = std::cos(kConeForward) * out + std::sin(kConeForward) * axes_.forward;
  const Vector3d cone = std::cos(kConeDown) * level - std::sin(kConeDown) * axes_.up;
  const Vector3d f = std::cos(kConeForward) * axes_.forward - std::sin(kConeForward) * out;

  const auto bent = bend_below(b);
  const Vector3d front = bent ? Vector3d(bent->cross(limb(b))) : turned(out, limb(b), axes_.forward);
  const auto bound = frame(limb(b), front);
  const auto untwisted = frame(cone, turned(out, cone, axes_.forward) + turned(-axes_.up, cone, axes_.forward));
  const auto neutral = frame(cone, f);
  if (!bound || !untwisted || !neutral) return std::nullopt;
  return JointAxes{*bound * untwisted->transpose() * *neutral, *neutral, axes_.up};
}

std::optional<JointAxes> Anatomy::thigh(int b) const {
  const auto bent = bend_below(b);
  const Vector3d front = bent ? Vector3d(-bent->cross(limb(b))) : turned(-axes_.up, limb(b), axes_.forward);
  const auto bound = frame(limb(b), front);
  const auto neutral = frame(-axes_.up, axes_.forward);
  if (!bound || !neutral) return std::nullopt;
  return JointAxes{*bound, *neutral, outward(b)};
}

std::optional<JointAxes> Anatomy::finger(int b) const {
  const auto hand = palm(b);
  if (!hand) return std::nullopt;
  const bool thumb = layout_[b].name.part == BonePart::kThumb;
  const bool base = layout_[b].name.segment == 1;
  const Vector3d along = limb(nearest_above(layout_, b, BonePart::kHand));
  // About this axis a thumb beside the index finger bends across the palm.
  const Vector3d thumb_axis = hand->thumb.cross(along);
  const auto bent = base ? std::nullopt : bend(b);
  const Vector3d straight_f = thumb ? Vector3d(thumb_axis.cross(limb(b))) : hand->normal;
  const Vector3d f = bent ? Vector3d(bent->cross(limb(b))) : straight_f;
  const Vector3d a = thumb ? hand->normal : hand->thumb;
  return thumb && base ? from_bind(b, f, a) : in_line(b, f, a);
}

std::optional<JointAxes> Anatomy::joint(int b) const {
  const BonePart part = layout_[b].name.part;
  if (is_finger(part)) return finger(b);
  switch (part) {
    case BonePart::kSpine:
    case BonePart::kChest:
    case BonePart::kNeck:
      return from_bind_in_middle(limb(b), axes_.forward);
    case BonePart::kHead:
      return from_bind_in_middle(axes_.up, axes_.forward);
    case BonePart::kJaw:
      return from_bind_in_middle(limb(b), -axes_.up);
    case BonePart::kEye:
      return from_bind(b, axes_.up, axes_.left);
    case BonePart::kClavicle:
      return from_bind(b, axes_.forward, axes_.up);
    case BonePart::kUpperArm:
      return upper_arm(b);
    case BonePart::kForearm:
      return in_line(b, elbow_bends_to(b), axes_.up);
    case BonePart::kHand: {
      const auto hand = palm(b);
      return hand ? in_line(b, hand->normal, hand->thumb) : std::nullopt;
    }
    case BonePart::kThigh:
      return thigh(b);
    case BonePart::kShin:
      return in_line(b, knee_bends_to(b), axes_.up);
    case BonePart::kFoot: {
      const int shin = limb_above(layout_, b);
      return from_bind(b, shin < 0 ? axes_.up : Vector3d(-limb(shin)), outward(b));
    }
    case BonePart::kToes:
      return from_bind(b, axes_.up, outward(b));
    default:
      return std::nullopt;
  }
}

/// Where the feet point along `ahead`, as a sum of shares of their lengths, and how many there are.
std::pair<double, int> feet_towards(const BodyLayout& layout, const Vector3d& ahead) {
  double sum = 0.0;
  int feet = 0;
  for (int b = 0; b < static_cast<int>(layout.size()); ++b) {
    if (layout[b].name.part != BonePart::kFoot) continue;
    sum += ahead.dot(limb_direction(layout, b));
    ++feet;
  }
  return {sum, feet};
}

/// How many more names say left than right on the side of the plane that its normal points to.
int names_towards_normal(const BodyLayout& layout, const Mirror& mirror) {
  int votes = 0;
  for (const BodyPlace& body : layout) {
    if (body.name.side == BodySide::kNone) continue;
    const bool left = body.name.side == BodySide::kLeft;
    votes += left == (mirror.normal.dot(body.com) > mirror.offset) ? 1 : -1;
  }
  return votes;
}

}  // namespace

std::optional<BodyAxes> find_body_axes(const BodyLayout& layout, const Mirror& mirror) {
  if (!mirror.found) return std::nullopt;
  const Vector3d up = across(Vector3d::UnitZ(), mirror.normal);
  if (!(up.norm() > std::sin(kLeastAcross))) return std::nullopt;
  BodyAxes axes;
  axes.up = up.normalized();
  axes.forward = mirror.normal.cross(axes.up);
  const auto [sum, feet] = feet_towards(layout, axes.forward);
  const bool feet_tell = std::abs(sum) > kLeastForward * feet;
  const double sign = feet_tell ? sum : names_towards_normal(layout, mirror);
  if (sign == 0.0) return std::nullopt;
  if (sign < 0.0) axes.forward = -axes.forward;
  axes.left = axes.up.cross(axes.forward);
  return axes;
}

std::optional<JointAxes> find_joint_axes(const BodyLayout& layout, const Mirror& mirror,
                                         const std::optional<BodyAxes>& body_axes, int b) {
  if (!body_axes) return std::nullopt;
  return Anatomy(layout, mirror, *body_axes).joint(b);
}

JointAxes plain_axes(const Vector3d& limb) {
  Matrix3d axes;
  axes << limb, limb.unitOrthogonal(), limb.cross(limb.unitOrthogonal());
  return {axes, axes, axes.col(1)};
}

}  // namespace layfigure::doll
