#pragma once

#include "bone_names.h"

namespace layfigure::doll {

/// How far a joint turns from its neutral pose [deg], each >= kLeastRangeDeg. The limb swings towards a direction f
/// across it or away from f, towards a second one a or away from a, and it twists: f towards a or away from a. Which
/// directions these are for each part is told in joint_axes.h.
struct RangeOfMotion {
  double towards_f{0.0};
  double away_from_f{0.0};
  double towards_a{0.0};
  double away_from_a{0.0};
  double twist_towards_a{0.0};
  double twist_away_from_a{0.0};
};

/// A joint that anatomy gives no range to has this much all the same: it is soft, sags by a few degrees, and a limit
/// at the neutral pose itself would act all the time.
inline constexpr double kLeastRangeDeg = 5.0;

/// Of bones whose part is not known.
inline constexpr double kWideSwingDeg = 120.0;
inline constexpr double kWideTwistDeg = 90.0;

/// The range of an adult's joint above a bone of that part, of a finger its segment 1 to 3. Spine with chest, and neck
/// with head, are one range each, which `sharers` joints share evenly. Source: American Academy of Orthopaedic
/// Surgeons, Joint Motion: Method of Measuring and Recording (1965); what it does not measure, from Kapandji, The
/// Physiology of the Joints (1970-74). The table in the source file tells which is which.
[[nodiscard]] RangeOfMotion range_of_motion(BonePart part, int segment, int sharers);

}  // namespace layfigure::doll
