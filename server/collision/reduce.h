#pragma once

#include <Eigen/Core>
#include <vector>

#include "narrow_phase.h"

namespace layfigure::collision {

/// Puts some of `points` into the manifold, in ascending order of feature: of those at most `layer` [m] above the
/// deepest up to kLayerPoints, and of the others as many again, which may come to touch. Of each layer the deepest, the
/// one farthest from it, and on either side of the line through those the one farthest from it. Points that the
/// manifold had before count as better by `hysteresis` [m]. `normal` is the points' common one. `points` is sorted.
void reduce(std::vector<LocalPoint>& points, const Eigen::Vector3d& normal, double layer, double hysteresis,
            Manifold& manifold);

}  // namespace layfigure::collision
