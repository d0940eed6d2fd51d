#include "joint_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "joint_axes.h"
#include "range_of_motion.h"
#include "stated_limits.h"

namespace layfigure::doll {
namespace {

using dynamics::JointLimits;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRadian = std::numbers::pi / 180.0;
constexpr double kRoom = kLeastRangeDeg * kRadian;

Quaterniond bind_of_parent(const BodyLayout& layout, int b) {
  return layout[b].parent < 0 ? Quaterniond::Identity() : layout[layout[b].parent].bind;
}

/// How many joints bend as one with that of `b`.
int sharers(const BodyLayout& layout, int b) {
  const auto group = [](BonePart part) {
    if (part == BonePart::kChest) return BonePart::kSpine;
    return part == BonePart::kHead ? BonePart::kNeck : part;
  };
  return static_cast<int>(std::count_if(layout.begin(), layout.end(), [&](const BodyPlace& body) {
    return body.parent >= 0 && group(body.name.part) == group(layout[b].name.part);
  }));
}

/// Puts the axes, world, into the limits' frames.
void set_axes(const JointAxes& axes, const BodyLayout& layout, int b, JointLimits& limits) {
  const Matrix3d R_BW = layout[b].bind.toRotationMatrix().transpose();
  const Matrix3d R_PW = bind_of_parent(layout, b).toRotationMatrix().transpose();
  limits.axes = Quaterniond(R_BW * axes.child).normalized();
  limits.reference = (Quaterniond(R_PW * axes.neutral) * limits.axes.conjugate()).normalized();
}

void set_range(const RangeOfMotion& range, bool y_towards_a, JointLimits& limits) {
  const double towards_a = range.towards_a * kRadian;
  const double away_from_a = range.away_from_a * kRadian;
  const double twist_towards_a = range.twist_towards_a * kRadian;
  const double twist_away = range.twist_away_from_a * kRadian;
  limits.swing_lower = {range.away_from_f * kRadian, y_towards_a ? away_from_a : towards_a};
  limits.swing_upper = {range.towards_f * kRadian, y_towards_a ? towards_a : away_from_a};
  limits.twist_lower = y_towards_a ? -twist_away : -twist_towards_a;
  limits.twist_upper = y_towards_a ? twist_towards_a : twist_away;
}

JointLimits limits_of(const BodyLayout& layout, const Mirror& mirror, const std::optional<BodyAxes>& body_axes, int b) {
  if (layout[b].stated) return stated_limits(layout[b], limb_direction(layout, b));
  JointLimits limits;
  if (const auto axes = find_joint_axes(layout, mirror, body_axes, b)) {
    const BoneName& name = layout[b].name;
    set_axes(*axes, layout, b, limits);
    // A swing about z moves the limb towards y, a twist f.
    set_range(range_of_motion(name.part, name.segment, sharers(layout, b)), axes->neutral.col(1).dot(axes->a) > 0.0,
              limits);
    return limits;
  }
  set_axes(plain_axes(limb_direction(layout, b)), layout, b, limits);
  limits.reference = layout[b].rest;
  set_range(range_of_motion(BonePart::kUnknown, 0, 1), true, limits);
  return limits;
}

/// Widens what is less than kRoom beyond the rest pose. Returns whether the rest pose was not inside.
bool widen(const Quaterniond& rest, JointLimits& limits) {
  const dynamics::LimitState state = limit_state(limits, rest);
  const bool outside = std::min({state.lower_twist.gap, state.upper_twist.gap, state.swing.gap}) <= 0.0;
  limits.twist_lower = std::min(limits.twist_lower, state.twist - kRoom);
  limits.twist_upper = std::max(limits.twist_upper, state.twist + kRoom);
  if (state.swing.gap >= kRoom) return outside;
  // With F^2 = (s_y / l_y)^2 + (s_z / l_z)^2 the gap is (1 - F) / |dF/ds|. Both l times k make it (k - F) / |dF/ds|.
  const Eigen::Array2d s = state.swing_y_z.array();
  double& l_y = s.x() < 0.0 ? limits.swing_lower[0] : limits.swing_upper[0];
  double& l_z = s.y() < 0.0 ? limits.swing_lower[1] : limits.swing_upper[1];
  const Eigen::Array2d l(l_y, l_z);
  const double F = (s / l).matrix().norm();
  const double k = F + kRoom * (s / l / l).matrix().norm() / F;
  l_y *= k;
  l_z *= k;
  return outside;
}

/// The wider of each bound.
JointLimits united(JointLimits limits, const JointLimits& other) {
  limits.twist_lower = std::min(limits.twist_lower, other.twist_lower);
  limits.twist_upper = std::max(limits.twist_upper, other.twist_upper);
  for (const int k : {0, 1}) {
    limits.swing_lower[k] = std::max(limits.swing_lower[k], other.swing_lower[k]);
    limits.swing_upper[k] = std::max(limits.swing_upper[k], other.swing_upper[k]);
  }
  return limits;
}

void report(const BodyPlace& body, std::vector<std::string>& warnings) {
  const std::string what = body.stated ? std::string("the limits that the file states for its joint")
                                       : "what the joint of a " + std::string(part_text(body.name.part)) + " can do";
  warnings.push_back("bone '" + body.bone + "': its rest pose is beyond " + what +
                     "; its limits are widened to include it");
}

/// The other side's body that had its limits chosen before; -1: none, or a file states the limits of one of them.
int model_of(const BodyLayout& layout, const Mirror& mirror, int b) {
  const int image = mirror.mirror_of_body[b];
  return image < b && image >= 0 && !layout[b].stated && !layout[image].stated ? image : -1;
}

}  // namespace

JointLimits mirrored_limits(const JointLimits& limits, const BodyLayout& layout, const Mirror& mirror, int body,
                            int other) {
  const Matrix3d S = mirror.reflection();
  const Eigen::DiagonalMatrix<double, 3> flip(1.0, -1.0, 1.0);
  JointAxes axes;
  axes.child = S * (layout[body].bind * limits.axes).toRotationMatrix() * flip;
  axes.neutral = S * (bind_of_parent(layout, body) * reference_axes(limits)).toRotationMatrix() * flip;
  JointLimits image = limits;
  set_axes(axes, layout, other, image);
  image.twist_lower = -limits.twist_upper;
  image.twist_upper = -limits.twist_lower;
  std::swap(image.swing_lower[1], image.swing_upper[1]);
  return image;
}

std::vector<JointLimits> make_joint_limits(const BodyLayout& layout, const Mirror& mirror,
                                           std::vector<std::string>& warnings) {
  const std::optional<BodyAxes> body_axes = find_body_axes(layout, mirror);
  std::vector<JointLimits> all(layout.size());
  for (int b = 0; b < static_cast<int>(layout.size()); ++b) {
    if (layout[b].parent < 0) continue;
    const int image = model_of(layout, mirror, b);
    all[b] =
        image < 0 ? limits_of(layout, mirror, body_axes, b) : mirrored_limits(all[image], layout, mirror, image, b);
    if (widen(layout[b].rest, all[b])) report(layout[b], warnings);
    if (image >= 0) all[image] = united(all[image], mirrored_limits(all[b], layout, mirror, b, image));
  }
  return all;
}

std::vector<Reason> limit_reasons(const BodyLayout& layout, const Mirror& mirror) {
  const std::optional<BodyAxes> body_axes = find_body_axes(layout, mirror);
  std::vector<Reason> reasons;
  for (int b = 0; b < static_cast<int>(layout.size()); ++b) {
    if (layout[b].stated) {
      reasons.push_back({Origin::kFile, "limits of the character's file"});
      continue;
    }
    const bool is_known = layout[b].parent >= 0 && find_joint_axes(layout, mirror, body_axes, b).has_value();
    reasons.push_back({Origin::kDefault, is_known
                                             ? std::string("anatomical range of the ") + part_text(layout[b].name.part)
                                             : "range of an unknown part"});
  }
  return reasons;
}

}  // namespace layfigure::doll
