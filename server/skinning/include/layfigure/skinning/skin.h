#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "layfigure/character/rig.h"

namespace layfigure::skinning {

/// The vertices of one mesh of the rig: [first, first + count) of the skin's.
struct MeshRange {
  int first{0};
  int count{0};
};

/// All meshes of a rig in flat arrays, one mesh after the other in the rig's order, and the bones that move them. Does
/// not change once it is made: threads may share it.
class Skin {
 public:
  /// Copies what it needs of the rig. Throws std::invalid_argument that names the bone, or the mesh and its vertex or
  /// triangle, the value and what was expected: a bone's parent that is no earlier bone, a bind pose that is not rigid,
  /// a vertex that is not finite, has no influences, an influence of a bone that there is not, or weights that are
  /// outside (0, 1] or do not sum to 1 within 1e-6, or a triangle of vertices that there are not. O(bones + influences
  /// + triangles).
  explicit Skin(const character::Rig& rig);

  [[nodiscard]] int bone_count() const { return static_cast<int>(bones_.size()); }
  [[nodiscard]] int vertex_count() const { return static_cast<int>(bind_positions_.size()); }

  [[nodiscard]] std::span<const character::Bone> bones() const { return bones_; }
  [[nodiscard]] std::span<const MeshRange> meshes() const { return meshes_; }
  [[nodiscard]] std::span<const Eigen::Vector3i> triangles() const {
    return triangles_;
  }  ///< counter-clockwise outside
  [[nodiscard]] std::span<const Eigen::Vector3d> bind_positions() const { return bind_positions_; }  ///< world [m]

  /// Unit, world: the mean of the normals of the mesh's triangles at the vertex, weighted by area; +Z where there is
  /// none.
  [[nodiscard]] std::span<const Eigen::Vector3d> bind_normals() const { return bind_normals_; }

  /// Of one vertex, heaviest first, never empty.
  [[nodiscard]] std::span<const character::Influence> influences(int vertex) const {
    const int first = first_influence_[vertex];
    return {influences_.data() + first, static_cast<std::size_t>(first_influence_[vertex + 1] - first)};
  }

 private:
  void add_mesh(const character::SkinnedMesh& mesh);

  std::vector<character::Bone> bones_;
  std::vector<MeshRange> meshes_;
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Eigen::Vector3d> bind_positions_;
  std::vector<Eigen::Vector3d> bind_normals_;
  std::vector<character::Influence> influences_;  ///< of all vertices, one after the other
  std::vector<int> first_influence_{0};           ///< by vertex, and the end
};

}  // namespace layfigure::skinning
