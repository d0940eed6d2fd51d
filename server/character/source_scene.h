#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "layfigure/character/rig.h"

/// What a character's file says, as plain data: between the format's library (source_reader.h) and the conversion.
namespace layfigure::character {

struct SourceNode {
  std::string name;
  int parent{-1};                                     ///< index of an earlier node; -1: the file's root
  Eigen::Affine3d pose{Eigen::Affine3d::Identity()};  ///< node -> file, the parents' included
  bool has_object{false};                             ///< it holds a mesh
  std::optional<BoneLimits> limits{};                 ///< beside its parent, helper nodes apart
};

/// One joint of a mesh's skin.
struct SourceJoint {
  struct Weight {
    int vertex;
    double weight;
  };
  int node{-1};
  Eigen::Affine3d offset{Eigen::Affine3d::Identity()};  ///< mesh -> joint, in the bind pose
  std::vector<Weight> weights;
};

struct SourceMesh {
  std::string name;
  int node{-1};
  int material{-1};                        ///< into SourceScene::materials; -1: none
  std::vector<Eigen::Vector3d> vertices;   ///< in the mesh's own frame
  std::vector<Eigen::Vector3d> normals;    ///< likewise, one per vertex, of any length; empty: none
  std::vector<Eigen::Vector2f> uvs;        ///< of the base colour texture, one per vertex, v upwards; empty: none
  std::vector<Eigen::Vector3i> triangles;  ///< indices in range
  std::vector<SourceJoint> joints;         ///< empty: not skinned
};

struct SourceScene {
  std::vector<SourceNode> nodes;  ///< parents before children
  std::vector<SourceMesh> meshes;
  std::vector<Material> materials;
  std::vector<Image> images;
  Eigen::Affine3d world_from_file{Eigen::Affine3d::Identity()};  ///< axes and unit
  double metres_per_unit{1.0};     ///< the file's or the format's unit, in world_from_file
  bool unit_is_stated{false};      ///< by the file or the format; else it is usual there
  bool skin_replaces_node{false};  ///< glTF's rule: a skinned mesh is placed by its joints, not by its own node
  std::vector<std::string> warnings;
};

}  // namespace layfigure::character
