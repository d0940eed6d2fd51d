#include "convert.h"

#include <set>
#include <stdexcept>

#include "skeleton.h"
#include "skin.h"

namespace layfigure::character {
namespace {

constexpr double kFarthest = 1e6;  // [m]; farther out, a float has no centimetres left
constexpr std::size_t kMostBones = 16384;

/// For points and for whole poses, whose other entries are at most 1.
template <class Matrix>
void check_place(const Matrix& place, const std::string& what) {
  if (place.allFinite() && place.cwiseAbs().maxCoeff() <= kFarthest) return;
  throw std::runtime_error(what +
                           " is not finite or farther than 1e6 m from the origin; check its scale and export it again");
}

void check_scene(const SourceScene& scene) {
  for (const SourceNode& node : scene.nodes) {
    if (!node.pose.matrix().allFinite())
      throw std::runtime_error("node '" + node.name + "' has a pose that is not finite; export it again");
  }
  for (const SourceMesh& mesh : scene.meshes) {
    for (const auto& vertex : mesh.vertices) {
      if (!vertex.allFinite())
        throw std::runtime_error("mesh '" + mesh.name + "' has a vertex that is not finite; export it again");
    }
    for (const SourceJoint& joint : mesh.joints) {
      for (const auto& weight : joint.weights) {
        if (!std::isfinite(weight.weight)) {
          throw std::runtime_error("mesh '" + mesh.name + "' has a weight that is not finite on bone '" +
                                   scene.nodes[joint.node].name + "'; paint it again");
        }
      }
    }
  }
}

void check_rig(const Rig& rig) {
  if (rig.bones.size() > kMostBones) {
    throw std::runtime_error("it has " + std::to_string(rig.bones.size()) + " bones, more than 16384; remove some");
  }
  for (const Bone& bone : rig.bones) check_place(bone.bind.matrix(), "bone '" + bone.name + "'");
  std::size_t triangles = 0;
  for (const SkinnedMesh& mesh : rig.meshes) {
    for (const auto& vertex : mesh.vertices) check_place(vertex, "a vertex of mesh '" + mesh.name + "'");
    triangles += mesh.triangles.size();
  }
  if (triangles == 0) throw std::runtime_error("it has no triangles; export it with its mesh");
}

/// Gives the items (bones or meshes) names that are unique and not empty.
template <class Item>
void make_names_unique(std::vector<Item>& items, const std::string& kind, std::vector<std::string>& warnings) {
  std::set<std::string> taken;
  for (const Item& item : items) taken.insert(item.name);
  std::set<std::string> used;
  for (std::size_t index = 0; index < items.size(); ++index) {
    std::string& name = items[index].name;
    if (!name.empty() && used.insert(name).second) continue;
    const std::string stem = name.empty() ? kind : name;
    std::size_t number = index;
    std::string fresh;
    do {
      fresh = stem + "_" + std::to_string(number++);
    } while (taken.contains(fresh) || used.contains(fresh));
    warnings.push_back(kind + " " + std::to_string(index) +
                       (name.empty() ? " has no name" : ": name '" + name + "' is used twice") + ": called '" + fresh +
                       "'");
    name = fresh;
    used.insert(fresh);
  }
}

}  // namespace

Rig convert(const SourceScene& scene) {
  check_scene(scene);
  Skeleton skeleton = make_skeleton(scene);
  Rig rig;
  rig.warnings = std::move(skeleton.warnings);
  rig.meshes = make_meshes(scene, skeleton, rig.warnings);
  rig.bones = std::move(skeleton.bones);
  make_names_unique(rig.bones, "bone", rig.warnings);
  make_names_unique(rig.meshes, "mesh", rig.warnings);
  check_rig(rig);
  rig.content_hash = content_hash(rig);
  return rig;
}

}  // namespace layfigure::character
