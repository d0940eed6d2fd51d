#include "layfigure/skinning/skin.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace layfigure::skinning {
namespace {

using character::Bone;
using character::Influence;
using character::SkinnedMesh;
using Eigen::Vector3d;

/// Weights and rotations that were read as floats and used as such are off by some 1e-7.
constexpr double kRoundingTolerance = 1e-6;

const Eigen::IOFormat kOneLine(Eigen::StreamPrecision, Eigen::DontAlignCols, ", ", "; ", "", "", "[", "]");

template <class Value>
[[noreturn]] void refuse(const std::string& what, const std::string& quantity, const Value& value,
                         const std::string& expected) {
  std::ostringstream message;
  message << what << ": " << quantity << " = " << value << ", expected " << expected;
  throw std::invalid_argument(message.str());
}

/// What an index may be, in words.
std::string below(std::size_t count) { return count == 0 ? "none" : "0 to " + std::to_string(count - 1); }

bool is_index(int index, std::size_t count) { return index >= 0 && static_cast<std::size_t>(index) < count; }

bool is_rigid(const Eigen::Isometry3d& X) {
  const Eigen::Matrix3d R = X.linear();
  return X.matrix().allFinite() && R.determinant() > 0.0 &&
         (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= kRoundingTolerance;
}

void validate(const std::vector<Bone>& bones) {
  for (int b = 0; b < static_cast<int>(bones.size()); ++b) {
    const std::string what = "bone '" + bones[b].name + "' (" + std::to_string(b) + ")";
    const int parent = bones[b].parent;
    if (parent < -1 || parent >= b) refuse(what, "parent", parent, "-1 (a root) or an earlier bone");
    if (!is_rigid(bones[b].bind)) {
      refuse(what, "bind", bones[b].bind.matrix().format(kOneLine), "finite, a rotation and a translation");
    }
    if (!bones[b].rest.translation().allFinite()) {
      refuse(what, "rest translation", bones[b].rest.translation().transpose(), "finite");
    }
  }
}

void validate_influences(const std::string& what, const std::vector<Influence>& influences, std::size_t bones) {
  double sum = 0.0;
  for (const Influence& i : influences) {
    if (!is_index(i.bone, bones)) refuse(what, "bone", i.bone, below(bones));
    if (!(i.weight > 0.0 && i.weight <= 1.0)) {
      refuse(what, "weight of bone " + std::to_string(i.bone), i.weight, "in (0, 1]");
    }
    sum += i.weight;
  }
  if (!(std::abs(sum - 1.0) <= kRoundingTolerance)) refuse(what, "sum of weights", sum, "1");
}

void validate(const SkinnedMesh& mesh, std::size_t bones) {
  const std::string what = "mesh '" + mesh.name + "'";
  const std::size_t count = mesh.vertices.size();
  if (mesh.influences.size() != count) {
    refuse(what, "lists of influences", mesh.influences.size(), std::to_string(count) + ", one per vertex");
  }
  for (std::size_t v = 0; v < count; ++v) {
    const std::string vertex = what + ", vertex " + std::to_string(v);
    if (!mesh.vertices[v].allFinite()) refuse(vertex, "position", mesh.vertices[v].transpose(), "finite");
    validate_influences(vertex, mesh.influences[v], bones);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const int corner : mesh.triangles[t]) {
      if (!is_index(corner, count)) refuse(what + ", triangle " + std::to_string(t), "corner", corner, below(count));
    }
  }
}

/// Adds to each vertex the normals of its triangles, as long as twice their areas.
void add_triangle_normals(const SkinnedMesh& mesh, std::span<Vector3d> normals) {
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    const Vector3d normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    for (const int corner : t) normals[corner] += normal;
  }
}

}  // namespace

Skin::Skin(const character::Rig& rig) : bones_(rig.bones) {
  validate(bones_);
  for (const SkinnedMesh& mesh : rig.meshes) {
    validate(mesh, bones_.size());
    add_mesh(mesh);
  }
}

void Skin::add_mesh(const SkinnedMesh& mesh) {
  const MeshRange range{vertex_count(), static_cast<int>(mesh.vertices.size())};
  meshes_.push_back(range);
  bind_positions_.insert(bind_positions_.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (const std::vector<Influence>& list : mesh.influences) {
    influences_.insert(influences_.end(), list.begin(), list.end());
    std::stable_sort(influences_.begin() + first_influence_.back(), influences_.end(),
                     [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
    first_influence_.push_back(static_cast<int>(influences_.size()));
  }
  for (const Eigen::Vector3i& t : mesh.triangles) triangles_.emplace_back(t.array() + range.first);

  bind_normals_.resize(bind_positions_.size(), Vector3d::Zero());
  const std::span<Vector3d> normals(bind_normals_.data() + range.first, mesh.vertices.size());
  add_triangle_normals(mesh, normals);
  for (Vector3d& normal : normals) {
    normal.normalize();
    if (normal.isZero()) normal = Vector3d::UnitZ();
  }
}

}  // namespace layfigure::skinning
