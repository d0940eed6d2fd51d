#include "range_of_motion.h"

#include <algorithm>

namespace layfigure::doll {
namespace {

struct Row {
  BonePart part;
  int segment;
  RangeOfMotion range;
};

/// AAOS where nothing else is said. 5 stands for none (kLeastRangeDeg).
constexpr Row kRows[] = {
    // Flexion and extension; bending to the sides; rotation. Of thorax and loins together.
    {BonePart::kSpine, 0, {80, 25, 35, 35, 45, 45}},
    {BonePart::kNeck, 0, {45, 45, 45, 45, 60, 60}},
    // Opening (Kapandji's successors have none: 40 mm between the teeth of an adult are 25 degrees).
    {BonePart::kJaw, 0, {25, 5, 5, 5, 5, 5}},
    {BonePart::kEye, 0, {35, 35, 35, 35, 5, 5}},
    // Forwards and backwards; up and down; its front up and down. Kapandji's sternoclavicular joint.
    {BonePart::kClavicle, 0, {30, 20, 40, 10, 30, 10}},
    // The cone about the neutral direction of joint_axes.h. AAOS's flexion and abduction 180, extension 60, horizontal
    // flexion 135 and extension 45, and adduction 45 in front are 0.91 to 1.09 times as far from it as its rim.
    // Rotation outwards, inwards.
    {BonePart::kUpperArm, 0, {112, 76, 130, 80, 90, 70}},
    {BonePart::kForearm, 0, {150, 5, 5, 5, 5, 5}},
    // Flexion and extension; towards the thumb and the little finger; supination and pronation, which take place along
    // the forearm: a forearm of one body does them at its end.
    {BonePart::kHand, 0, {80, 70, 20, 30, 80, 80}},
    // Flexion and extension across the palm; AAOS's abduction of 70, half of it to either side of the rest pose.
    {BonePart::kThumb, 1, {15, 20, 35, 35, 15, 15}},
    {BonePart::kThumb, 2, {50, 10, 10, 10, 5, 5}},
    {BonePart::kThumb, 3, {80, 20, 5, 5, 5, 5}},
    // Abduction by Kapandji.
    {BonePart::kIndex, 1, {90, 45, 20, 20, 10, 10}},
    {BonePart::kIndex, 2, {100, 5, 5, 5, 5, 5}},
    {BonePart::kIndex, 3, {90, 10, 5, 5, 5, 5}},
    // Flexion and extension; abduction and adduction; rotation outwards and inwards.
    {BonePart::kThigh, 0, {120, 30, 45, 30, 45, 45}},
    // Kapandji has the shin turn only when the knee is bent.
    {BonePart::kShin, 0, {135, 10, 5, 5, 10, 10}},
    // Dorsiflexion, plantar flexion; the toes outwards and inwards by Kapandji; inversion and eversion.
    {BonePart::kFoot, 0, {20, 50, 15, 20, 35, 15}},
    {BonePart::kToes, 0, {70, 45, 10, 10, 5, 5}},
};

/// Parts that move as another one does.
BonePart as_in_table(BonePart part) {
  if (part == BonePart::kChest) return BonePart::kSpine;
  if (part == BonePart::kHead) return BonePart::kNeck;
  return is_finger(part) && part != BonePart::kThumb ? BonePart::kIndex : part;
}

constexpr RangeOfMotion kWide{kWideSwingDeg, kWideSwingDeg, kWideSwingDeg, kWideSwingDeg, kWideTwistDeg, kWideTwistDeg};

}  // namespace

RangeOfMotion range_of_motion(BonePart part, int segment, int sharers) {
  const auto row = std::find_if(std::begin(kRows), std::end(kRows),
                                [&](const Row& r) { return r.part == as_in_table(part) && r.segment == segment; });
  if (row == std::end(kRows)) return kWide;
  const bool shared = row->part == BonePart::kSpine || row->part == BonePart::kNeck;
  const auto share = [&](double degrees) { return shared ? std::max(degrees / sharers, kLeastRangeDeg) : degrees; };
  const RangeOfMotion& all = row->range;
  return {share(all.towards_f),   share(all.away_from_f),     share(all.towards_a),
          share(all.away_from_a), share(all.twist_towards_a), share(all.twist_away_from_a)};
}

}  // namespace layfigure::doll
