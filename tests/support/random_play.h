#pragma once

#include "layfigure/doll/doll.h"

namespace layfigure::testing {

struct Play {
  double force{0.0};   ///< the largest that a device was told, as a part of what its guard allows
  double torque{0.0};  ///< likewise
  double rise{0.0};    ///< of the force in a tick, likewise
  long contacts{0};    ///< that fingertips began
  long grabs{0};
  double together{0.0};          ///< for how long both hands held or touched the doll at once [s]
  long failures{0};              ///< steps that failed, or left what is not finite
  double lowest_hand_over{0.0};  ///< of the hand-over's ledger [J]
};

/// Two simulated SPIDARs with their hands touch, press, rub, grab and pull a doll at random places for so long [s], in
/// lockstep, served `ticks` times in each step. The same each time.
[[nodiscard]] Play play_at_random(doll::Doll doll, double duration, double physics_hz, int ticks);

}  // namespace layfigure::testing
