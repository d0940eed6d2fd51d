#include "skeleton.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <optional>
#include <stdexcept>

namespace layfigure::character {
namespace {

using Eigen::Affine3d;

/// Two skins that disagree by more than this about a bone's place [m] or axes are reported; below it is float rounding.
constexpr double kBindTolerance = 1e-3;

bool is_helper(const SourceNode& node) { return node.name.find("_$AssimpFbx$_") != std::string::npos; }

std::vector<bool> find_joints(const SourceScene& scene) {
  std::vector<bool> joint(scene.nodes.size(), false);
  bool any = false;
  for (const SourceMesh& mesh : scene.meshes) {
    for (const SourceJoint& source : mesh.joints) any = joint[source.node] = true;
  }
  if (!any)
    throw std::runtime_error("it has no bones: no mesh is skinned; bind its mesh to a skeleton and export it with it");
  return joint;
}

/// Deepest node that is at or above every joint. Nodes are in tree order, so a parent's index is always smaller.
int common_ancestor(const SourceScene& scene, const std::vector<bool>& joint) {
  int common = -1;
  for (int node = 0; node < static_cast<int>(joint.size()); ++node) {
    if (!joint[node]) continue;
    int other = node;
    if (common < 0) common = node;
    while (common != other) (common > other ? common : other) = scene.nodes[std::max(common, other)].parent;
  }
  return common;
}

/// Joints, what lies between them, and the empty nodes below them.
std::vector<bool> choose_bones(const SourceScene& scene, const std::vector<bool>& joint, int root) {
  const int count = static_cast<int>(scene.nodes.size());
  std::vector<bool> bone(count, false);
  std::vector<bool> object_below(count, false);
  for (int node = count - 1; node >= 0; --node) {  // children first
    if (joint[node]) bone[node] = true;
    if (scene.nodes[node].has_object) object_below[node] = true;
    const int parent = scene.nodes[node].parent;
    if (parent < 0) continue;
    if (bone[node] && node != root) bone[parent] = true;
    if (object_below[node]) object_below[parent] = true;
  }
  std::vector<bool> below_joint = joint;
  for (int node = 0; node < count; ++node) {
    const int parent = scene.nodes[node].parent;
    if (parent < 0 || !below_joint[parent] || object_below[node]) continue;
    bone[node] = below_joint[node] = true;
  }
  for (int node = 0; node < count; ++node) {
    if (is_helper(scene.nodes[node]) && !joint[node] && node != root) bone[node] = false;
  }
  return bone;
}

Affine3d inverse_offset(const SourceScene& scene, const SourceJoint& joint) {
  const double volume = std::abs(joint.offset.linear().determinant());
  if (!(volume > 1e-30 && volume < 1e30)) {
    throw std::runtime_error("the bind matrix of bone '" + scene.nodes[joint.node].name +
                             "' cannot be inverted; bind the mesh to the skeleton again");
  }
  return joint.offset.inverse();
}

/// A skinned mesh -> world in the bind pose.
Affine3d skinned_mesh_pose(const SourceScene& scene, const SourceMesh& mesh) {
  if (!scene.skin_replaces_node) return scene.world_from_file * scene.nodes[mesh.node].pose;
  const SourceJoint* topmost = &mesh.joints.front();
  for (const SourceJoint& joint : mesh.joints) {
    if (joint.node < topmost->node) topmost = &joint;
  }
  return scene.world_from_file * scene.nodes[topmost->node].pose * topmost->offset;
}

using Binds = std::vector<std::optional<Affine3d>>;  // per node, scale included

/// The binds that the skins state.
Binds skin_binds(const SourceScene& scene, std::vector<std::string>& warnings) {
  Binds binds(scene.nodes.size());
  for (const SourceMesh& mesh : scene.meshes) {
    if (mesh.joints.empty()) continue;
    const Affine3d X_WM = skinned_mesh_pose(scene, mesh);
    for (const SourceJoint& joint : mesh.joints) {
      const Affine3d bind = X_WM * inverse_offset(scene, joint);
      auto& known = binds[joint.node];
      if (known && !known->isApprox(bind, kBindTolerance)) {
        warnings.push_back("bone '" + scene.nodes[joint.node].name + "' is bound differently by mesh '" + mesh.name +
                           "': the first mesh's bind pose is used");
      }
      if (!known) known = bind;
    }
  }
  return binds;
}

/// The binds of all other nodes: as the file poses them beside a node whose bind is known, the parent first.
void complete_binds(const SourceScene& scene, Binds& binds) {
  const auto beside = [&](int node, int known) {
    return Affine3d(*binds[known] * scene.nodes[known].pose.inverse() * scene.nodes[node].pose);
  };
  const int count = static_cast<int>(scene.nodes.size());
  std::vector<int> bound_below(count, -1);
  for (int node = count - 1; node >= 0; --node) {
    if (binds[node]) bound_below[node] = node;
    const int parent = scene.nodes[node].parent;
    if (parent >= 0 && bound_below[node] >= 0) bound_below[parent] = bound_below[node];
  }
  for (int node = 0; node < count; ++node) {
    if (binds[node]) continue;
    const int parent = scene.nodes[node].parent;
    if (parent >= 0 && binds[parent]) {
      binds[node] = beside(node, parent);
    } else if (bound_below[node] >= 0) {
      binds[node] = beside(node, bound_below[node]);
    }
  }
}

/// Drops scale, shear and mirroring; keeps the place and the nearest rotation.
Eigen::Isometry3d rigid(const Affine3d& pose) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(pose.linear(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.col(2) *= -1.0;
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = u * svd.matrixV().transpose();
  result.translation() = pose.translation();
  return result;
}

/// The limits of a node that is no root's, if its frame and its parent's can be made rigid without turning them: angles
/// in a mirrored frame run the other way.
std::optional<BoneLimits> usable_limits(const SourceScene& scene, int node, const Binds& binds, int parent_node,
                                        std::vector<std::string>& warnings) {
  const SourceNode& source = scene.nodes[node];
  if (!source.limits || parent_node < 0) return std::nullopt;
  const auto is_mirrored = [&](int n) { return binds[n]->linear().determinant() < 0.0; };
  if (!is_mirrored(node) && !is_mirrored(parent_node)) return source.limits;
  warnings.push_back("bone '" + source.name + "' is mirrored by a scale below 0: the limits of its joint are left out");
  return std::nullopt;
}

void add_bones(const SourceScene& scene, const std::vector<bool>& is_bone, const Binds& binds, Skeleton& skeleton) {
  skeleton.bone_of_node.assign(scene.nodes.size(), -1);
  std::vector<int> node_of_bone;
  for (std::size_t node = 0; node < scene.nodes.size(); ++node) {
    const int above = scene.nodes[node].parent;
    const int parent = above < 0 ? -1 : skeleton.bone_of_node[above];
    skeleton.bone_of_node[node] = parent;
    if (!is_bone[node]) continue;
    Bone bone;
    bone.name = scene.nodes[node].name;
    bone.parent = parent;
    bone.bind = rigid(*binds[node]);
    bone.rest = parent < 0 ? bone.bind : skeleton.bones[parent].bind.inverse() * bone.bind;
    bone.limits =
        usable_limits(scene, static_cast<int>(node), binds, parent < 0 ? -1 : node_of_bone[parent], skeleton.warnings);
    node_of_bone.push_back(static_cast<int>(node));
    skeleton.bone_of_node[node] = static_cast<int>(skeleton.bones.size());
    skeleton.bones.push_back(std::move(bone));
  }
}

}  // namespace

Skeleton make_skeleton(const SourceScene& scene) {
  Skeleton skeleton;
  const std::vector<bool> joint = find_joints(scene);
  const std::vector<bool> is_bone = choose_bones(scene, joint, common_ancestor(scene, joint));
  Binds binds = skin_binds(scene, skeleton.warnings);
  complete_binds(scene, binds);
  add_bones(scene, is_bone, binds, skeleton);
  for (const SourceMesh& mesh : scene.meshes) {
    const Affine3d rigid_pose = binds[mesh.node].value_or(scene.world_from_file * scene.nodes[mesh.node].pose);
    skeleton.mesh_poses.push_back(mesh.joints.empty() ? rigid_pose : skinned_mesh_pose(scene, mesh));
  }
  return skeleton;
}

}  // namespace layfigure::character
