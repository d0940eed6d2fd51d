#pragma once

#include <optional>

#include "layfigure/collision/shapes.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/pointer_pose.h"

namespace layfigure::haptics {

/// Of an adult's index finger [m]: its breadth is 16 to 20 mm.
inline constexpr double kFingertipRadius = 0.008;
inline constexpr double kMinFingertipRadius = 1e-3;
inline constexpr double kMaxFingertipRadius = 0.1;

/// Of the last bone of a finger with its flesh [kg], for a doll as heavy as a hand or more; for a lighter one this part
/// of its mass, about that of a limb. The hand behind it, which the coupling stands for, is what the doll feels; this
/// mass is only to be no larger than what it touches, so that a blow is that of the coupling, and of its size, so that
/// the contact's rows are well conditioned. It has no weight: the hand carries that.
inline constexpr double kFingertipMass = 0.010;
inline constexpr double kFingertipShare = 0.02;
[[nodiscard]] double fingertip_mass(double doll_mass);

/// The pad's circle (scene::Pad) beside the fingertip's radius. A finger that presses with some newtons flattens to a
/// disc three quarters as wide as itself; one of even pressure resists spin like a circle of 2/3 of it. It is as deep
/// as the fingertip: what presses on something does not roll there.
inline constexpr double kPadShare = 0.5;

/// Of dry skin on smooth plastic or wood; 0.5 to 1.5 are measured at a few newtons.
inline constexpr double kFingertipFriction = 1.0;
inline constexpr double kMaxFriction = 10.0;

/// From the tip to the knuckle about which a finger gives way [m]: the spring that turns it is the spring that moves it
/// times this squared.
inline constexpr double kKnuckleDistance = 0.05;

/// A fingertip: a ball with a pad, held by a 6-DOF coupling to its pointer; while it presses on something it pushes and
/// twists that, and does not tilt it (soft_tip.h).
struct FingertipDefinition {
  double radius{kFingertipRadius};      ///< [m], kMinFingertipRadius to kMaxFingertipRadius
  double friction{kFingertipFriction};  ///< 0 to kMaxFriction; a contact takes the geometric mean with the doll's
  bool magnet{false};                   ///< sticks to what it touches, see Hands::set_magnet
};

/// A free root of the doll's model at `pose`, of `mass` [kg].
[[nodiscard]] dynamics::BodyDefinition fingertip_body(int pointer, const FingertipDefinition& fingertip, double mass,
                                                      const PointerPose& pose);
/// Its shape on body `body`.
[[nodiscard]] collision::ShapeDefinition fingertip_shape(int pointer, const FingertipDefinition& fingertip, int body);

/// What holds it: gains of translation, and those of rotation from kKnuckleDistance.
[[nodiscard]] dynamics::Coupling fingertip_coupling(double stiffness, double damping);

}  // namespace layfigure::haptics
