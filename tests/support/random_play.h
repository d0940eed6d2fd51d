#pragma once

#include "layfigure/doll/doll.h"

namespace layfigure::testing {

struct Play {
  double force{0.0};   ///< the largest that a device was told, as a part of what its guard allows
  double torque{0.0};  ///< likewise
  double rise{0.0};    ///< of the force in a tick, likewise
  long contacts{0};    ///< that fingertips began
  long grabs{0};
  double duration{0.0};          ///< of all of it [s]
  double together{0.0};          ///< for how long both hands held or touched the doll at once [s]
  long failures{0};              ///< steps that failed, or left what is not finite
  double lowest_hand_over{0.0};  ///< of the hand-over's ledger [J]
};

/// Two simulated SPIDARs with their hands touch, press, rub, grab and pull a doll at random places, in lockstep, served
/// `ticks` times in each step, until both have been on it at once for so long [s], or never come to be. The same each
/// time.
[[nodiscard]] Play play_at_random(doll::Doll doll, double together, double physics_hz, int ticks);

}  // namespace layfigure::testing
