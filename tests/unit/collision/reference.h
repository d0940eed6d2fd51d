#pragma once

#include <Eigen/Core>
#include <vector>

namespace layfigure::collision::testing {

using Points = std::vector<Eigen::Vector3d>;

/// The signed distance of two convex hulls by exhaustion, sharing no code with the library: if some axis parts them,
/// the least distance between any two segments, or a vertex and a triangle, over all their vertices; else the largest
/// separation along any normal of three vertices or of two segments.
double signed_distance(const Points& a, const Points& b);

/// The largest separation over those axes: the distance of two hulls cannot be less.
double largest_separation(const Points& a, const Points& b);

}  // namespace layfigure::collision::testing
