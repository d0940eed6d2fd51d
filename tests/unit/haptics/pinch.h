#pragma once

#include "layfigure/haptics/hands.h"

namespace layfigure::haptics {

constexpr double kStep = 1e-3;
constexpr double kPinchStiffness = 1000.0;  // [N/m] of each fingertip

[[nodiscard]] PointerPose at(const Eigen::Vector3d& position);

/// So many steps; each must be done.
void run(Hands& hands, int steps);

/// Two fingertips, of pointers 0 and 1, at a limb of kLimbRadius along x, from +y and -y. `squeeze` is how far each
/// pointer is behind the place where its fingertip just touches [m].
class Pinch {
 public:
  /// Brings them out beside the limb, whose middle is at `middle`.
  Pinch(Hands& hands, const Eigen::Vector3d& middle, const FingertipDefinition& fingertip = {});

  /// Where pointer `id` squeezes so far, moved by `shift`.
  void aim(int id, double squeeze, const Eigen::Vector3d& shift = Eigen::Vector3d::Zero());
  /// Both, over so many steps that are to come.
  void glide_to(double squeeze, int steps, const Eigen::Vector3d& shift = Eigen::Vector3d::Zero());
  /// The normal force of pointer `id` [N].
  [[nodiscard]] double pressure(int id) const;

 private:
  Hands& hands_;
  Eigen::Vector3d middle_;
  double contact_distance_;
};

/// Where the fingertip is in the frame of body `body`.
[[nodiscard]] Eigen::Vector3d fingertip_in_body(const Hands& hands, int pointer, int body);

/// How far the fingertips have slid on a limb [m] that was pinched for so long [s], its com off by `off_center` [m], in
/// hands that tremble by `tremor` [m]: these never let the scene rest.
[[nodiscard]] double pinch_drift(double duration, double off_center, double tremor);

/// What hands that tilt do to a limb that they pinch.
enum class Tilting {
  kInPlace,         ///< each fingertip turns where it is
  kAboutTheMiddle,  ///< both go round the limb's middle with it
};

struct TiltDrift {
  double way;   ///< of the fingertips on the limb [m], the larger
  double turn;  ///< of the limb [rad]
};

/// Two hands tilt by `tilt` [rad], go round so many circles with that, one in a second, and tilt back. The limb's com
/// is `off_center` [m] along x, so that its weight twists what holds it.
[[nodiscard]] TiltDrift drift_by_tilting(Tilting how, int circles, double tilt, double off_center = 0.0);

/// The pressure [N] at which a limb slides out of fingers of a coefficient of friction that open slowly; by Coulomb's
/// law it is slip_pressure().
[[nodiscard]] double pressure_at_slip(double friction);
[[nodiscard]] double slip_pressure(double friction);

}  // namespace layfigure::haptics
