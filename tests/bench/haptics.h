#pragma once

#include <filesystem>
#include <vector>

#include "figures.h"

/// The parts of the subject `haptics`, each a row or some of the table of what the haptics are held to.
namespace layfigure::bench {

/// How much they take on.
struct HapticsEffort {
  long contacts;                    ///< random contacts whose energy is added up
  long wrenches;                    ///< random wrenches that are asked of the device
  double rest;                      ///< for how long a pose is left alone [s]
  double pinch;                     ///< for how long a limb is pinched [s]
  double play;                      ///< for how long two hands that play at random are on the doll at once [s]
  double rung;                      ///< ratio of a stiffness to the one tried before it
  std::vector<double> dampings;     ///< of walls [N s/m]
  std::vector<double> frequencies;  ///< at which the doll is felt [Hz]
  long ticks;                       ///< that are timed
};

/// Stable walls: the largest stiffness for a damping, at a rate.
struct WallPoint {
  double rate_hz;
  bool hand;         ///< pressed by a hand, or by an elastic band
  double damping;    ///< [N s/m]
  double stiffness;  ///< [N/m], 0: none
};

void tell_device(const HapticsEffort& effort, std::vector<Figure>& figures);
[[nodiscard]] std::vector<WallPoint> tell_walls(const HapticsEffort& effort, std::vector<Figure>& figures);
void tell_energy(const HapticsEffort& effort, std::vector<Figure>& figures);
void tell_felt(const HapticsEffort& effort, std::vector<Figure>& figures);
void tell_rest(const HapticsEffort& effort, std::vector<Figure>& figures);
void tell_pinch(const HapticsEffort& effort, std::vector<Figure>& figures);
void tell_play(const HapticsEffort& effort, std::vector<Figure>& figures);
void tell_tick_times(const HapticsEffort& effort, std::vector<Figure>& figures);

}  // namespace layfigure::bench
