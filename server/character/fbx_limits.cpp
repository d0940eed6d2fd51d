#include "fbx_limits.h"

#include <cmath>
#include <numbers>
#include <string_view>

namespace layfigure::character {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRadian = std::numbers::pi / 180.0;
constexpr std::string_view kHelper = "_$AssimpFbx$_";
constexpr std::string_view kPreRotation = "_$AssimpFbx$_PreRotation";
constexpr std::string_view kPostRotation = "_$AssimpFbx$_PostRotation";  // which is R_post^-1

Quaterniond rotation_of(const aiMatrix4x4& m) {
  Eigen::Matrix3d matrix;
  matrix << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  return Quaterniond(matrix).normalized();
}

/// Sets the node's axes and reference from its helper nodes, which are above it in one line.
void set_frames(const aiNode& node, BoneLimits& limits) {
  Quaterniond pre = Quaterniond::Identity();
  Quaterniond post_inverse = Quaterniond::Identity();
  for (const aiNode* above = node.mParent; above != nullptr; above = above->mParent) {
    const std::string_view name = above->mName.C_Str();
    if (name.find(kHelper) == std::string_view::npos) break;
    if (name.ends_with(kPreRotation)) pre = rotation_of(above->mTransformation);
    if (name.ends_with(kPostRotation)) post_inverse = rotation_of(above->mTransformation);
  }
  limits.axes = post_inverse.conjugate();
  limits.reference = (pre * post_inverse).normalized();
}

bool is_set(const aiMetadata& properties, const std::string& name) {
  bool value = false;
  return properties.Get(name, value) && value;
}

/// The bounds `name` [rad] of the axes whose flags are set; `none` for the others.
Vector3d bounds(const aiMetadata& properties, const std::string& name, double none) {
  aiVector3D angles;  // FBX's default where the file gives a flag alone
  properties.Get(name, angles);
  const Vector3d values(angles.x, angles.y, angles.z);
  Vector3d result;
  for (int k = 0; k < 3; ++k) result[k] = is_set(properties, name + "XYZ"[k]) ? kRadian * values[k] : none;
  return result;
}

/// Drops the bounds of an axis that mean nothing. Returns whether it did.
bool drop_senseless(BoneLimits& limits, int axis) {
  double& lower = limits.lower[axis];
  double& upper = limits.upper[axis];
  const bool has_sense = lower <= upper && lower < BoneLimits::kInfinity && upper > -BoneLimits::kInfinity;
  if (has_sense) return false;
  lower = -BoneLimits::kInfinity;
  upper = BoneLimits::kInfinity;
  return true;
}

}  // namespace

std::optional<BoneLimits> fbx_limits(const aiNode& node, const std::string& name, std::vector<std::string>& warnings) {
  if (node.mMetaData == nullptr || !is_set(*node.mMetaData, "RotationActive")) return std::nullopt;
  BoneLimits limits;
  limits.lower = bounds(*node.mMetaData, "RotationMin", -BoneLimits::kInfinity);
  limits.upper = bounds(*node.mMetaData, "RotationMax", BoneLimits::kInfinity);
  for (int axis = 0; axis < 3; ++axis) {
    if (!drop_senseless(limits, axis)) continue;
    warnings.push_back("bone '" + name + "': its lower limit about " + "xyz"[axis] +
                       " is above the upper one, or not finite: left out");
  }
  const bool bounds_nothing = limits.lower.maxCoeff() == -BoneLimits::kInfinity &&  //
                              limits.upper.minCoeff() == BoneLimits::kInfinity;
  if (bounds_nothing) return std::nullopt;
  set_frames(node, limits);
  return limits;
}

}  // namespace layfigure::character
