#include "convert.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <set>
#include <stdexcept>

#include "looks.h"
#include "skeleton.h"
#include "skin.h"
#include "unit.h"

namespace layfigure::character {
namespace {

constexpr double kFarthest = 1e6;  // [m]; farther out, a float has no centimetres left
constexpr std::size_t kMostBones = 16384;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

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

double longest_side(const Rig& rig) {
  Eigen::AlignedBox3d box;
  for (const SkinnedMesh& mesh : rig.meshes) {
    for (const auto& vertex : mesh.vertices) box.extend(vertex);
  }
  return box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
}

void scale(Rig& rig, double factor) {
  for (Bone& bone : rig.bones) {
    bone.rest.translation() *= factor;
    bone.bind.translation() *= factor;
  }
  for (SkinnedMesh& mesh : rig.meshes) {
    for (auto& vertex : mesh.vertices) vertex *= factor;
  }
}

std::string unit_name(double metres_per_unit) {
  if (metres_per_unit == 1.0) return "metres";
  if (metres_per_unit == 0.01) return "centimetres";
  if (metres_per_unit == 0.001) return "millimetres";
  if (metres_per_unit == kInch) return "inches";
  return "units of " + number(metres_per_unit) + " m";
}

/// Brings the rig to a sane size where its unit is not stated or cannot be meant; what was assumed is reported.
void mend_unit(const SourceScene& scene, Rig& rig) {
  const double size = longest_side(rig);
  if (!(size > 0.0 && std::isfinite(size))) return;
  const UnitChoice choice = choose_unit(size, scene.metres_per_unit, scene.unit_is_stated);
  const double factor = choice.metres_per_unit / scene.metres_per_unit;
  if (factor != 1.0) scale(rig, factor);
  const std::string result = "its longest side is " + number(factor * size) + " m";
  if (!choice.fits) {
    rig.warnings.push_back(result + ", which is no doll's size: scale it if it is not meant to be");
  } else if (factor != 1.0 && scene.unit_is_stated) {
    rig.warnings.push_back("its unit would make it " + number(size) + " m long: taken as " +
                           unit_name(choice.metres_per_unit) + ", so that " + result);
  } else if (!scene.unit_is_stated && choice.metres_per_unit != 1.0) {
    rig.warnings.push_back("its format states no unit: taken as " + unit_name(choice.metres_per_unit) + ", so that " +
                           result);
  }
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
  rig.warnings = scene.warnings;
  rig.warnings.insert(rig.warnings.end(), skeleton.warnings.begin(), skeleton.warnings.end());
  rig.meshes = make_meshes(scene, skeleton, rig.warnings);
  add_looks(scene, rig);
  rig.bones = std::move(skeleton.bones);
  mend_unit(scene, rig);
  make_names_unique(rig.bones, "bone", rig.warnings);
  make_names_unique(rig.meshes, "mesh", rig.warnings);
  check_rig(rig);
  rig.content_hash = content_hash(rig);
  return rig;
}

}  // namespace layfigure::character
