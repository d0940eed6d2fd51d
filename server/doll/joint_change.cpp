#include "layfigure/doll/joint_change.h"

#include <algorithm>
#include <stdexcept>

#include "axis_values.h"
#include "name_pattern.h"
#include "overrides.h"

namespace layfigure::doll {
namespace {

void make_absolute(OptionalEntry<Amount>& entry, double made) {
  if (entry) entry->value = {entry->value.of(made), false};
}

void make_absolute(OptionalEntry<AxisAmounts>& entry, const Eigen::Vector3d& made) {
  if (!entry) return;
  for (int k = 0; k < 3; ++k) {
    std::optional<Amount>& amount = entry->value[k];
    if (amount) amount = Amount{amount->of(made[k]), false};
  }
}

}  // namespace

std::vector<int> bones_named(const character::Rig& rig, const std::string& pattern) {
  std::vector<std::string> names;
  for (const character::Bone& bone : rig.bones) names.push_back(bone.name);
  if (const auto own = std::ranges::find(names, pattern); own != names.end()) {
    return {static_cast<int>(own - names.begin())};
  }
  std::vector<int> bones;
  for (std::size_t bone = 0; bone < names.size(); ++bone) {
    if (matches(pattern, names[bone])) bones.push_back(static_cast<int>(bone));
  }
  if (!bones.empty()) return bones;
  std::string near;
  for (const std::string& name : near_names(pattern, names)) near += (near.empty() ? "'" : ", '") + name + "'";
  throw std::invalid_argument("no bone is called '" + pattern + "'" + (near.empty() ? "" : "; near names: " + near));
}

dynamics::BodyDefinition changed_joint(JointOverride wish, const dynamics::BodyDefinition& made,
                                       dynamics::BodyDefinition now) {
  const dynamics::JointLaw& law = made.joint;
  make_absolute(wish.stiffness, law.stiffness);
  make_absolute(wish.damping, law.damping);
  make_absolute(wish.flow_damping, law.flow_damping);
  make_absolute(wish.yield_torque, law.yield_torque);
  make_absolute(wish.hardening, law.hardening);
  make_absolute(wish.stiffness_axes, axis_values(law.stiffness, law.shape.stiffness));
  make_absolute(wish.damping_axes, axis_values(law.damping, law.shape.damping));
  make_absolute(wish.yield_torque_axes, axis_values(law.yield_torque, law.shape.yield));
  Reasons unused;
  apply_to_joint(wish, now, unused);
  return now;
}

}  // namespace layfigure::doll
