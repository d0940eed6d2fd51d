#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "layfigure/skinning/skin.h"

namespace layfigure::skinning {

/// Which triangles of a skin adjoin. Corners are one point if they are bound to the same place by the same bones: those
/// stay together in every pose, whichever meshes they are of.
struct Topology {
  std::vector<Eigen::Vector3i> corners;     ///< the points of each triangle
  std::vector<Eigen::Vector3i> neighbours;  ///< of each triangle, across the edge opposite to the corner; -1: none
  std::vector<int> triangles_around;        ///< of all points, one after the other
  std::vector<int> first_around;            ///< by point, and the end
  /// Whether the part of the skin that a triangle is connected to is closed: two triangles at each edge, facing the
  /// same side.
  std::vector<bool> closed;

  [[nodiscard]] std::span<const int> around(int point) const {
    const int first = first_around[point];
    return {triangles_around.data() + first, static_cast<std::size_t>(first_around[point + 1] - first)};
  }
};

/// O(n log n).
[[nodiscard]] Topology make_topology(const Skin& skin);

}  // namespace layfigure::skinning
