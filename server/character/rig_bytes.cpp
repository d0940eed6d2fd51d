#include "rig_bytes.h"

#include <stdexcept>

#include "layfigure/cache/bytes.h"

namespace layfigure::character {
namespace {

[[noreturn]] void refuse_index() { throw std::runtime_error("an index in the rig is out of range"); }

void check_indices(const SkinnedMesh& mesh, int bones) {
  const int vertices = static_cast<int>(mesh.vertices.size());
  if (mesh.influences.size() != mesh.vertices.size()) refuse_index();
  for (const auto& triangle : mesh.triangles) {
    if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= vertices) refuse_index();
  }
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
  for (const SkinnedMesh& mesh : rig.meshes) check_indices(mesh, static_cast<int>(rig.bones.size()));
}

}  // namespace

std::string to_bytes(const ImportRecord& record) { return cache::to_bytes(record); }

ImportRecord from_bytes(std::string_view bytes) {
  ImportRecord record = cache::from_bytes<ImportRecord>(bytes);
  check_indices(record.rig);
  return record;
}

}  // namespace layfigure::character
