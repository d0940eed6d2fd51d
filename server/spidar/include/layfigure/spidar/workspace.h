#pragma once

#include "layfigure/spidar/geometry.h"

namespace layfigure::spidar {

/// What the device can do at a pose.
struct Reach {
  bool wrench_closed{false};
  double force{0.0};   ///< the largest that can be had in every direction, without a torque [N]
  double wrench{0.0};  ///< the largest in every direction of forces and torques at once, torques as the force at the
                       ///< grip's radius that makes them [N]; 0 at the border of the workspace and beyond it
};

/// The wrenches W t for tensions in the range form a zonotope, whose facets lie across the normals n that five strings
/// leave out: n . w <= sum over the strings of max(n . w_i t_min, n . w_i t_max). `wrench` is the distance from none to
/// the nearest facet, `force` that within the forces. O(56 facets), about 50 us: for reports, not for every tick.
[[nodiscard]] Reach reach_at(const Geometry& geometry, const Pose& pose);

}  // namespace layfigure::spidar
