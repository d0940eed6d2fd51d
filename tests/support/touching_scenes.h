#pragma once

#include "layfigure/scene/scene.h"

/// Things to stack, drop and press.
namespace layfigure::testing {

[[nodiscard]] collision::ShapeDefinition floor_shape(double friction);

/// The shape of a box about a body's com, as a hull.
[[nodiscard]] collision::ShapeDefinition box_shape(const dynamics::BodyDefinition& body, int index,
                                                   const Eigen::Vector3d& half_size, double friction);

/// Free cubes over each other on the floor, a gap of `gap` below each.
[[nodiscard]] scene::SceneDefinition stack(int cubes, double gap, double friction);

/// A little doll of nine capsules, its joints elastic up to `yield_torque`, `height` over the floor.
[[nodiscard]] scene::SceneDefinition capsule_doll(double height, double yield_torque);

/// Deepest overlap among the scene's contacts as they are now [m], 0 if none.
[[nodiscard]] double overlap(scene::Scene& scene, const dynamics::State& state);

}  // namespace layfigure::testing
