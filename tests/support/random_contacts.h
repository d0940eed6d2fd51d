#pragma once

/// Hands that play with dolls at random, and the energy that comes of it.
namespace layfigure::testing {

struct ContactEnergy {
  long contacts{0};              ///< that began
  double taken_in{0.0};          ///< net work of the hands together on what is rendered [J]
  double lowest_hand_over{0.0};  ///< the lowest state of the hand-over's ledger [J]
  long together{0};              ///< of them, those that began while the other hand touched
  double largest_force{0.0};     ///< on a hand [N]
  double booked{0.0};            ///< of what steps of physics lost by themselves, in that ledger [J] ...
  double lost{0.0};              ///< ... and what they lost by their own [J]
  double overbooked{0.0};        ///< by which the first exceeded the second most in a step, beyond rounding [J]
  long unsolved{0};              ///< complementarity problems of ticks
};

/// A ball in each of one or two hands taps a limb and rubs along it at random places, depths, speeds and stiffnesses,
/// until there have been so many contacts; two hands come from opposite sides, each in its own time, so that they
/// squeeze the limb, take turns at it and feel each other through it. The same each time.
[[nodiscard]] ContactEnergy run_random_contacts(int hands, long contacts, double physics_hz, double haptic_hz);

/// A hand that shakes the doll of 52 joints by the wrist, at a frequency [Hz] and amplitude [m], for so long [s].
[[nodiscard]] ContactEnergy shake_doll(double frequency, double physics_hz, double amplitude, double duration);

}  // namespace layfigure::testing
