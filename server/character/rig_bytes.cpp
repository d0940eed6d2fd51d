#include "rig_bytes.h"

#include <stdexcept>

#include "layfigure/cache/bytes.h"

namespace layfigure::character {
namespace {

[[noreturn]] void refuse_index() { throw std::runtime_error("an index in the rig is out of range"); }

void check_triangles(const std::vector<Eigen::Vector3i>& triangles, std::size_t end) {
  for (const auto& triangle : triangles) {
    if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= static_cast<int>(end)) refuse_index();
  }
}

void check_wedges(const SkinnedMesh& mesh) {
  const Wedges& wedges = mesh.wedges;
  if (!wedges.triangles.empty() && wedges.triangles.size() != mesh.triangles.size()) refuse_index();
  for (const std::size_t count : {wedges.normals.size(), wedges.uvs.size()}) {
    if (count == 0) continue;
    if (count < mesh.vertices.size()) refuse_index();
    check_triangles(wedges.triangles, count);
  }
}

/// `index` is -1 or of one of `count`.
void check_choice(int index, std::size_t count) {
  if (index < -1 || index >= static_cast<int>(count)) refuse_index();
}

void check_indices(const SkinnedMesh& mesh, int bones) {
  if (mesh.influences.size() != mesh.vertices.size()) refuse_index();
  check_triangles(mesh.triangles, mesh.vertices.size());
  check_wedges(mesh);
  for (const auto& list : mesh.influences) {
    if (list.empty()) refuse_index();
    for (const Influence& influence : list) {
      if (influence.bone < 0 || influence.bone >= bones) refuse_index();
    }
  }
}

void check_indices(const Rig& rig) {
  for (std::size_t bone = 0; bone < rig.bones.size(); ++bone) {
    if (rig.bones[bone].parent < -1 || rig.bones[bone].parent >= static_cast<int>(bone)) refuse_index();
  }
  for (const SkinnedMesh& mesh : rig.meshes) {
    check_indices(mesh, static_cast<int>(rig.bones.size()));
    check_choice(mesh.material, rig.materials.size());
  }
  for (const Material& material : rig.materials) check_choice(material.image, rig.images.size());
}

}  // namespace

std::string to_bytes(const ImportRecord& record) { return cache::to_bytes(record); }

ImportRecord from_bytes(std::string_view bytes) {
  ImportRecord record = cache::from_bytes<ImportRecord>(bytes);
  check_indices(record.rig);
  return record;
}

}  // namespace layfigure::character
