#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "layfigure/collision/shapes.h"
#include "layfigure/doll/doll.h"

/// What the bodies of a doll touch each other with.
namespace layfigure::doll {

/// Of a convex set that holds the points, at most so many of them: the difference of support functions
///     max over unit n of (max over all points of n . p  -  max over those chosen of n . p)
/// is the Hausdorff distance of the two hulls. The points are chosen greedily, each the one that the hull so far misses
/// most of 642 directions spread evenly over the sphere, until it misses none by more than `tolerance`.
/// O(642 (points + most)). Returns indices; of a hull that lies in a plane or on a line, fewer.
[[nodiscard]] std::vector<int> hull_points(const std::vector<Eigen::Vector3d>& points, double tolerance, int most);

/// A simplified hull of the points, which are in the body's frame: none misses it by more than 2 % of their size but
/// where 32 vertices are too few for that. `points`: one or more.
[[nodiscard]] collision::ShapeDefinition make_hull(const std::vector<Eigen::Vector3d>& points);

/// The capsule along the longest principal axis of the solid: as thick as the solid cylinder of its mass and moment
/// about that axis, r = sqrt(2 I / m), and as long as the points reach, but no less than a ball. `points`: one or more.
[[nodiscard]] collision::ShapeDefinition make_capsule(const std::vector<Eigen::Vector3d>& points,
                                                      const dynamics::BodyDefinition& body);

/// Bodies beside parents and children that overlap in the doll's rest pose: skin that closes up about a joint, thighs
/// that rest on each other. They never meet.
[[nodiscard]] std::vector<std::pair<int, int>> overlapping_at_rest(
    const dynamics::ModelDefinition& definition, const std::vector<collision::ShapeDefinition>& shapes);

}  // namespace layfigure::doll
