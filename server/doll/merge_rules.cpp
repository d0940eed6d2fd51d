#include "merge_rules.h"

#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace layfigure::doll {
namespace {

using character::Bone;
using Eigen::Vector3d;

// Further than this from its line, a bone of the same name is no segment of a limb: a spider's leg_01, leg_02, ..
constexpr double kStraight = 30.0 * std::numbers::pi / 180.0;

class Rules {
 public:
  Rules(const std::vector<Bone>& bones, const std::vector<BoneName>& names) : bones_(bones), names_(names) {}

  [[nodiscard]] std::optional<Merge> merge(int b) const {
    const BoneName& name = names_[b];
    if (bones_[b].parent < 0) return std::nullopt;
    if (name.use == BoneUse::kTwist) return as(twisted_limb(b), BoneReason::kTwistHelper);
    if (name.use == BoneUse::kControl) return std::nullopt;
    if (name.part == BonePart::kFace || name.part == BonePart::kEye) {
      return as(nearest_above(b, BonePart::kHead), BoneReason::kFace);
    }
    return as(segmented(b), BoneReason::kSegment);
  }

 private:
  [[nodiscard]] static std::optional<Merge> as(int host, BoneReason reason) {
    return host < 0 ? std::nullopt : std::optional(Merge{host, reason});
  }

  [[nodiscard]] bool same_limb(int a, int b) const {
    return names_[a].part != BonePart::kUnknown && names_[a].part == names_[b].part && names_[a].side == names_[b].side;
  }

  [[nodiscard]] int nearest_above(int b, BonePart part) const {
    int above = bones_[b].parent;
    while (above >= 0 && names_[above].part != part) above = bones_[above].parent;
    return above;
  }

  /// The nearest limb above that the helper is called after, or the one beside it.
  [[nodiscard]] int twisted_limb(int b) const {
    for (int above = bones_[b].parent; above >= 0; above = bones_[above].parent) {
      if (same_limb(above, b)) return above;
    }
    for (int beside = 0; beside < static_cast<int>(bones_.size()); ++beside) {
      const bool sibling = beside != b && bones_[beside].parent == bones_[b].parent;
      if (sibling && names_[beside].use == BoneUse::kLimb && same_limb(beside, b)) return beside;
    }
    return -1;
  }

  [[nodiscard]] int segmented(int b) const {
    const int parent = bones_[b].parent;
    switch (names_[b].part) {
      case BonePart::kMetacarpal: {
        const int hand = nearest_above(b, BonePart::kHand);
        return hand >= 0 && names_[hand].side == names_[b].side ? hand : -1;
      }
      case BonePart::kHips:  // CMU's LHipJoint, MakeHuman's pelvis.L
        return names_[b].side != BodySide::kNone || same_limb(parent, b) ? parent : -1;
      case BonePart::kHead:
      case BonePart::kJaw:
      case BonePart::kHand:
      case BonePart::kToes:
        return same_limb(parent, b) ? parent : -1;
      case BonePart::kClavicle:
        return same_limb(parent, b) && leads_to(b, BonePart::kUpperArm) ? parent : -1;
      case BonePart::kUpperArm:
        return divides(parent, b, BonePart::kForearm) ? parent : -1;
      case BonePart::kForearm:
        return divides(parent, b, BonePart::kHand) ? parent : -1;
      case BonePart::kThigh:
        return divides(parent, b, BonePart::kShin) ? parent : -1;
      case BonePart::kShin:
        return divides(parent, b, BonePart::kFoot) ? parent : -1;
      default:
        return -1;
    }
  }

  /// Whether `b` is a further piece of its parent's limb, after which comes the limb `next`.
  [[nodiscard]] bool divides(int parent, int b, BonePart next) const {
    return same_limb(parent, b) && leads_to(b, next) && in_line(parent, b);
  }

  [[nodiscard]] bool leads_to(int b, BonePart next) const {
    for (int c = b + 1; c < static_cast<int>(bones_.size()); ++c) {
      if (names_[c].part != next) continue;
      for (int above = bones_[c].parent; above >= b; above = bones_[above].parent) {
        if (above == b) return true;
      }
    }
    return false;
  }

  /// The pieces before and behind the joint of `b`.
  [[nodiscard]] bool in_line(int parent, int b) const {
    const Vector3d joint = bones_[b].bind.translation();
    const Vector3d before = joint - bones_[parent].bind.translation();
    for (int c = b + 1; c < static_cast<int>(bones_.size()); ++c) {
      if (bones_[c].parent != b) continue;
      const Vector3d behind = bones_[c].bind.translation() - joint;
      if (std::atan2(before.cross(behind).norm(), before.dot(behind)) <= kStraight) return true;
    }
    return false;
  }

  const std::vector<Bone>& bones_;
  const std::vector<BoneName>& names_;
};

}  // namespace

std::vector<std::optional<Merge>> merges_by_name(const std::vector<Bone>& bones, const std::vector<BoneName>& names) {
  const Rules rules(bones, names);
  std::vector<std::optional<Merge>> merges;
  for (int b = 0; b < static_cast<int>(bones.size()); ++b) merges.push_back(rules.merge(b));
  return merges;
}

}  // namespace layfigure::doll
