#include "body_layout.h"

namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

bool is_spine(BonePart part) { return part == BonePart::kSpine || part == BonePart::kChest; }

}  // namespace

bool continues(const BoneName& above, const BoneName& below) {
  if (is_spine(above.part)) {
    return is_spine(below.part) || below.part == BonePart::kNeck || below.part == BonePart::kHead;
  }
  if (is_finger(above.part)) return below.part == above.part && below.segment == above.segment + 1;
  switch (above.part) {
    case BonePart::kNeck:
      return below.part == BonePart::kNeck || below.part == BonePart::kHead;
    case BonePart::kClavicle:
      return below.part == BonePart::kUpperArm;
    case BonePart::kUpperArm:
      return below.part == BonePart::kForearm;
    case BonePart::kForearm:
      return below.part == BonePart::kHand;
    case BonePart::kHand:
      return is_finger(below.part) && below.part != BonePart::kThumb && below.segment == 1;
    case BonePart::kThigh:
      return below.part == BonePart::kShin;
    case BonePart::kShin:
      return below.part == BonePart::kFoot;
    case BonePart::kFoot:
      return below.part == BonePart::kToes;
    case BonePart::kUnknown:
      return true;
    default:
      return false;
  }
}

int nearest_above(const BodyLayout& layout, int b, BonePart part) {
  while (b >= 0 && layout[b].name.part != part) b = layout[b].parent;
  return b;
}

int limb_above(const BodyLayout& layout, int b) {
  const int parent = layout[b].parent;
  const bool known = parent >= 0 && layout[parent].name.part != BonePart::kUnknown;
  return known && continues(layout[parent].name, layout[b].name) ? parent : -1;
}

Vector3d limb_direction(const BodyLayout& layout, int b) {
  Vector3d next = Vector3d::Zero();
  int count = 0;
  for (int c = b + 1; c < static_cast<int>(layout.size()); ++c) {
    if (layout[c].parent != b || !continues(layout[b].name, layout[c].name)) continue;
    next += layout[c].joint;
    ++count;
  }
  const bool one_way = count == 1 || (count > 1 && layout[b].name.part == BonePart::kHand);
  const Vector3d to_next = one_way ? Vector3d(next / count - layout[b].joint) : Vector3d::Zero();
  const Vector3d to_com = layout[b].com - layout[b].joint;
  if (to_next.norm() > 0.0) return to_next.normalized();
  return to_com.norm() > 0.0 ? to_com.normalized() : layout[b].bind * Vector3d::UnitY();
}

}  // namespace layfigure::doll
