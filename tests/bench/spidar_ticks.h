#pragma once

#include "layfigure/spidar/geometry.h"

namespace layfigure::bench {

/// What a haptic tick of one pointer computes for its SPIDAR: the pose from the lengths, the tensions from a wrench.
struct SpidarTicks {
  double median_us;
  double p99_9_us;
  double most_us;
  double beyond_share;  ///< of ticks whose wrench the device cannot exert
  double exact_error;   ///< largest wrench error of the others [N], torques as forces at the grip's radius
  int most_pivots;      ///< of the tension solver
};

/// So many ticks at 1 kHz of a fast hand (2 Hz, 3 cm, 30 degrees) that is pushed by up to `force` newtons and a tenth
/// of a grip's radius times that, from rounded lengths. Times are of the wall clock, each tick by itself; of `passes`
/// over the same ticks each tick's least counts, so that what else the machine does does not. Allocates 8 bytes a tick.
[[nodiscard]] SpidarTicks measure_spidar_ticks(const spidar::Geometry& geometry, int ticks, int passes, double force);

}  // namespace layfigure::bench
