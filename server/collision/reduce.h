#pragma once

#include <Eigen/Core>
#include <vector>

#include "narrow_phase.h"

namespace layfigure::collision {

/// Puts up to kMaxPoints of `points` into the manifold, in ascending order of feature: the deepest, the one farthest
/// from it, and on either side of the line through those the one farthest from it. Points that the manifold had before
/// count as better by `hysteresis` [m]. `normal` is the points' common one.
void reduce(const std::vector<LocalPoint>& points, const Eigen::Vector3d& normal, double hysteresis,
            Manifold& manifold);

}  // namespace layfigure::collision
