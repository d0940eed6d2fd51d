#include "inspection.h"

#include <cstdio>

namespace layfigure::doll {

double total_mass(const Doll& doll) {
  double mass = 0.0;
  for (const auto& body : doll.definition.bodies) mass += body.mass;
  return mass;
}

std::string hash_text(const Doll& doll) {
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(doll.rig.content_hash));
  return digits;
}

AngleRange twist_range(const dynamics::JointLimits& limits) { return {limits.twist_lower, limits.twist_upper}; }

AngleRange swing_range(const dynamics::JointLimits& limits, int axis) {
  return {-limits.swing_lower[axis], limits.swing_upper[axis]};
}

}  // namespace layfigure::doll
