#include "overrides.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "angles.h"
#include "axis_values.h"
#include "name_pattern.h"
#include "override_names.h"
#include "settings_numbers.h"
#include "toml_text.h"
#include "value_range.h"

namespace layfigure::doll {
namespace {

using dynamics::JointLimits;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr std::size_t kMostNamesListed = 5;
constexpr double kRestSlack = 1e-6;                // [rad]; a rest pose on a limit is not outside for rounding
constexpr ValueRange kDensities{0.0, 1e6, false};  // those of a settings file

[[noreturn]] void refuse(const DollSettings& settings, int line, const std::string& why) {
  const std::string where = settings.source.empty() ? "doll settings: " : settings.source + ":";
  throw SettingsError(where + (line > 0 ? std::to_string(line) + ": " : "") + why);
}

std::string table_name(const JointOverride& joint) { return "[joints." + toml_key(joint.pattern) + "] "; }

/// Of what was put together for one bone.
std::string bone_name(const JointOverride& of_bone) { return "bone '" + toml_comment(of_bone.pattern) + "': "; }

std::string at_line(int line) { return line > 0 ? "line " + std::to_string(line) + " of the settings" : "given"; }

template <class T>
Reason reason_of(const OptionalEntry<T>& entry, const std::string& before = {}) {
  return {Origin::kSettings, before + at_line(entry->line)};
}

template <class T>
int line_of(const OptionalEntry<T>& entry) {
  return entry ? entry->line : 0;
}

std::string joined(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list.append(list.empty() ? "'" : ", '").append(toml_comment(name)).append("'");
  return list;
}

/// Which bones a table is for.
struct Target {
  std::vector<int> bones;
  bool is_exact{false};  ///< by its own name
};

class BoneNames {
 public:
  explicit BoneNames(const std::vector<character::Bone>& bones) {
    for (const character::Bone& bone : bones) {
      index_.emplace(bone.name, static_cast<int>(names_.size()));
      names_.push_back(bone.name);
    }
  }

  [[nodiscard]] const std::vector<std::string>& all() const { return names_; }

  [[nodiscard]] Target find(const JointOverride& joint) const {
    if (const auto own = index_.find(joint.pattern); own != index_.end()) return {{own->second}, true};
    Target target;
    for (std::size_t bone = 0; bone < names_.size(); ++bone) {
      if (matches(joint.pattern, names_[bone])) target.bones.push_back(static_cast<int>(bone));
    }
    return target;
  }

 private:
  std::vector<std::string> names_;
  std::map<std::string, int> index_;
};

std::string no_match(const JointOverride& joint, std::vector<std::string> names) {
  const std::vector<std::string> near = near_names(joint.pattern, names);
  if (!near.empty()) return table_name(joint) + "matches no bone; near names: " + joined(near);
  const bool all = names.size() <= kMostNamesListed;
  names.resize(std::min(names.size(), kMostNamesListed));
  return table_name(joint) + "matches no bone; the bones are " + joined(names) + (all ? "" : ", ...");
}

template <class T>
void take(const OptionalEntry<T>& from, OptionalEntry<T>& to) {
  if (from) to = from;
}

/// Of two ways to say one thing, each replaces the other.
template <class T, class Other>
void take_either(const OptionalEntry<T>& from, const OptionalEntry<Other>& from_other, OptionalEntry<T>& to,
                 OptionalEntry<Other>& to_other) {
  if (!from && !from_other) return;
  to = from;
  to_other = from_other;
}

void lay_over(const JointOverride& from, JointOverride& to) {
  take_either(from.stiffness, from.stiffness_axes, to.stiffness, to.stiffness_axes);
  take_either(from.damping, from.damping_axes, to.damping, to.damping_axes);
  take_either(from.yield_torque, from.yield_torque_axes, to.yield_torque, to.yield_torque_axes);
  take_either(from.density, from.mass, to.density, to.mass);
  take(from.flow_damping, to.flow_damping);
  take(from.hardening, to.hardening);
  take(from.twist, to.twist);
  take(from.swing_y, to.swing_y);
  take(from.swing_z, to.swing_z);
  take(from.locked, to.locked);
  take(from.merge, to.merge);
  take(from.shape, to.shape);
  take(from.friction, to.friction);
}

bool is_about_a_joint(const JointOverride& joint) {
  return joint.stiffness || joint.damping || joint.flow_damping || joint.yield_torque || joint.hardening ||
         joint.stiffness_axes || joint.damping_axes || joint.yield_torque_axes || joint.twist || joint.swing_y ||
         joint.swing_z || joint.locked;
}

bool is_about_a_body(const JointOverride& joint) {
  return joint.shape || joint.friction || joint.density || joint.mass;
}

bool has_joint(const Doll& doll, int bone) {
  const int body = doll.body_of_bone[bone];
  return body >= 0 && doll.definition.bodies[body].parent >= 0;
}

void check_not_idle(const JointOverride& joint, const BoneNames& names, const Doll& doll) {
  const std::vector<int> bones = names.find(joint).bones;
  const auto is_body = [&](int bone) { return doll.body_of_bone[bone] >= 0; };
  const std::string first = joined({names.all()[bones.front()]}) + " ";
  if ((is_about_a_joint(joint) || is_about_a_body(joint)) && std::none_of(bones.begin(), bones.end(), is_body)) {
    refuse(doll.settings, joint.line, table_name(joint) + "no body: " + first + "rides on its parent's; see merge");
  }
  const auto joins = [&](int bone) { return has_joint(doll, bone); };
  if (is_about_a_joint(joint) && std::none_of(bones.begin(), bones.end(), joins)) {
    refuse(doll.settings, joint.line, table_name(joint) + "no joint: " + first + "is the doll's root");
  }
}

void apply(const OptionalEntry<Amount>& entry, double& value, Reason& reason) {
  if (!entry) return;
  const Amount& amount = entry->value;
  value = amount.of(value);
  reason = reason_of(entry, amount.is_factor ? short_number(amount.number) + " times what was chosen, " : "");
}

/// Those of `amounts` that are given, in place of the axes' own values, or their multiples. Which ones, if not all,
/// goes before where they are given.
void apply(const OptionalEntry<AxisAmounts>& entry, double most, double& value, Vector3d& ratios, Reason& reason) {
  if (!entry) return;
  Vector3d values = axis_values(value, ratios);
  std::string given;
  bool all = true;
  for (int k = 0; k < 3; ++k) {
    const std::optional<Amount>& amount = entry->value[k];
    all = all && amount.has_value();
    if (!amount) continue;
    values[k] = std::min(amount->of(values[k]), most);
    given.append(given.empty() ? "" : " and ").append(kAxisNames[k]);
  }
  set_axis_values(values, value, ratios);
  const std::string rest = reason.text;
  reason = reason_of(entry, all ? "" : given + " by ");
  if (!all) reason.text += ", else " + rest;
}

double upper_bound(double angle) { return angle < std::numbers::pi ? angle : JointLimits::kInfinity; }

void apply_swing(const OptionalEntry<AngleRange>& range, int axis, JointLimits& limits, Reason& reason) {
  if (!range) return;
  limits.swing_lower[axis] = upper_bound(-range->value.lower);
  limits.swing_upper[axis] = upper_bound(range->value.upper);
  reason = reason_of(range);
}

std::string tenths_of_degrees(double angle) { return short_number(std::round(10.0 * to_degrees(angle)) / 10.0 + 0.0); }

void check_rest_pose(const JointOverride& joint, const dynamics::BodyDefinition& body, const DollSettings& settings) {
  const dynamics::LimitState rest = dynamics::limit_state(body.limits, body.rest_rotation);
  const double gap = std::min({rest.lower_twist.gap, rest.upper_twist.gap, rest.swing.gap});
  if (!(gap < -kRestSlack)) return;
  const int line = std::max({line_of(joint.twist), line_of(joint.swing_y), line_of(joint.swing_z)});
  refuse(settings, line,
         bone_name(joint) + "limits: the rest pose is outside, at twist " + tenths_of_degrees(rest.twist) +
             ", swing_y " + tenths_of_degrees(rest.swing_y_z.x()) + ", swing_z " +
             tenths_of_degrees(rest.swing_y_z.y()) + " degrees; widen them to hold it");
}

void apply_limits(const JointOverride& joint, dynamics::BodyDefinition& body, Reasons& reasons) {
  if (!joint.twist && !joint.swing_y && !joint.swing_z) return;
  JointLimits& limits = body.limits;
  if (joint.twist) {
    limits.twist_lower = -upper_bound(-joint.twist->value.lower);
    limits.twist_upper = upper_bound(joint.twist->value.upper);
    reasons.twist = reason_of(joint.twist);
  }
  apply_swing(joint.swing_y, 0, limits, reasons.swing_y);
  apply_swing(joint.swing_z, 1, limits, reasons.swing_z);
}

void apply_locks(const JointOverride& joint, dynamics::BodyDefinition& body, Reasons& reasons) {
  if (!joint.locked) return;
  body.joint.shape.locked = joint.locked->value;
  reasons.locked = reason_of(joint.locked);
}

void apply_to_body(const JointOverride& joint, Matter& matter, Reasons& reasons) {
  if (joint.shape) {
    matter.shape = joint.shape->value;
    reasons.shape = reason_of(joint.shape);
  }
  if (joint.friction) {
    matter.friction = joint.friction->value;
    reasons.friction = reason_of(joint.friction);
  }
}

double given_mass(const JointOverride& joint) { return joint.mass ? joint.mass->value : 0.0; }

void choose_density(const JointOverride& joint, double volume, const DollSettings& settings, Matter& matter,
                    Reasons& reasons) {
  matter.density = settings.density;
  reasons.density = {Origin::kDefault, why_of_number(settings, "density")};
  if (joint.density) {
    matter.density = joint.density->value;
    reasons.density = reason_of(joint.density);
  }
  if (joint.mass) {
    matter.density = joint.mass->value / volume;
    reasons.density = reason_of(joint.mass, "mass of " + short_number(joint.mass->value) + " kg, ");
    const std::string why = range_complaint("density of that mass", matter.density, kDensities);
    if (!why.empty()) refuse(settings, joint.mass->line, bone_name(joint) + "mass: " + why);
  }
}

/// Scales the densities of the bodies without a given mass, so that the whole weighs `total`.
void scale_densities(const std::vector<JointOverride>& of_bone, const std::vector<double>& volumes,
                     const Entry<double>& total, Doll& doll) {
  double given = 0.0;
  double chosen = 0.0;
  for (std::size_t b = 0; b < volumes.size(); ++b) {
    const JointOverride& joint = of_bone[doll.bone_of_body[b]];
    given += given_mass(joint);
    if (!joint.mass) chosen += doll.matter[b].density * volumes[b];
  }
  const double factor = (total.value - given) / chosen;
  if (!(factor > 0.0) || !std::isfinite(factor)) {
    refuse(doll.settings, total.line,
           "total_mass = " + short_number(total.value) + ", expected more than the " + short_number(given) +
               " kg of the bodies whose mass is given, and a body whose mass is not");
  }
  for (std::size_t b = 0; b < volumes.size(); ++b) {
    if (of_bone[doll.bone_of_body[b]].mass) continue;
    doll.matter[b].density *= factor;
    doll.reasons[b].density = {Origin::kSettings,
                               "scaled to weigh " + short_number(total.value) + " kg in all, " + at_line(total.line)};
    const std::string why = range_complaint("density of that mass", doll.matter[b].density, kDensities);
    if (!why.empty()) refuse(doll.settings, total.line, "total_mass: " + why);
  }
}

}  // namespace

void apply_to_joint(const JointOverride& joint, dynamics::BodyDefinition& body, Reasons& reasons) {
  dynamics::JointLaw& law = body.joint;
  apply(joint.stiffness, law.stiffness, reasons.stiffness);
  apply(joint.damping, law.damping, reasons.damping);
  apply(joint.flow_damping, law.flow_damping, reasons.flow_damping);
  apply(joint.yield_torque, law.yield_torque, reasons.yield_torque);
  apply(joint.hardening, law.hardening, reasons.hardening);
  apply(joint.stiffness_axes, dynamics::kRigidStiffness, law.stiffness, law.shape.stiffness, reasons.stiffness);
  apply(joint.damping_axes, kInfinity, law.damping, law.shape.damping, reasons.damping);
  apply(joint.yield_torque_axes, kInfinity, law.yield_torque, law.shape.yield, reasons.yield_torque);
  apply_limits(joint, body, reasons);
  apply_locks(joint, body, reasons);
}

std::vector<JointOverride> resolve_overrides(const DollSettings& settings, const std::vector<character::Bone>& bones) {
  const BoneNames names(bones);
  std::vector<JointOverride> result(bones.size());
  for (std::size_t bone = 0; bone < bones.size(); ++bone) result[bone].pattern = bones[bone].name;
  for (const bool exact : {false, true}) {
    for (const JointOverride& joint : settings.joints) {
      const Target target = names.find(joint);
      if (target.bones.empty()) refuse(settings, joint.line, no_match(joint, names.all()));
      if (target.is_exact != exact) continue;
      for (const int bone : target.bones) lay_over(joint, result[bone]);
    }
  }
  return result;
}

std::vector<MergeChoice> merge_choices(const std::vector<JointOverride>& of_bone) {
  std::vector<MergeChoice> choices(of_bone.size(), MergeChoice::kAutomatic);
  for (std::size_t bone = 0; bone < of_bone.size(); ++bone) {
    if (of_bone[bone].merge) choices[bone] = of_bone[bone].merge->value ? MergeChoice::kMerge : MergeChoice::kBody;
  }
  return choices;
}

void refuse_merge(const JointOverride& of_bone, const DollSettings& settings, const std::string& why) {
  refuse(settings, line_of(of_bone.merge), "merge: " + why);
}

void choose_densities(const std::vector<JointOverride>& of_bone, const std::vector<double>& volumes, Doll& doll) {
  doll.matter.resize(volumes.size());
  doll.reasons.resize(volumes.size());
  for (std::size_t b = 0; b < volumes.size(); ++b) {
    choose_density(of_bone[doll.bone_of_body[b]], volumes[b], doll.settings, doll.matter[b], doll.reasons[b]);
  }
  if (doll.settings.total_mass) scale_densities(of_bone, volumes, *doll.settings.total_mass, doll);
}

void apply_overrides(const std::vector<JointOverride>& of_bone, Doll& doll) {
  for (std::size_t bone = 0; bone < of_bone.size(); ++bone) {
    const JointOverride& joint = of_bone[bone];
    if (joint.merge) doll.body_reasons[bone] = reason_of(joint.merge);
    const int body = doll.body_of_bone[bone];
    if (body < 0) continue;
    apply_to_body(joint, doll.matter[body], doll.reasons[body]);
    if (!has_joint(doll, static_cast<int>(bone))) continue;
    apply_to_joint(joint, doll.definition.bodies[body], doll.reasons[body]);
    if (joint.twist || joint.swing_y || joint.swing_z) {
      check_rest_pose(joint, doll.definition.bodies[body], doll.settings);
    }
  }
  const BoneNames names(doll.rig.bones);
  for (const JointOverride& joint : doll.settings.joints) check_not_idle(joint, names, doll);
}

}  // namespace layfigure::doll
