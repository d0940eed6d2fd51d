#pragma once

#include "layfigure/character/rig.h"
#include "source_scene.h"

namespace layfigure::character {

/// Makes the rig of a scene: everything but name, source_file, source_folder. Throws std::runtime_error that says what
/// is wrong and the mend, without the file's name.
[[nodiscard]] Rig convert(const SourceScene& scene);

/// FNV-1a (64 bits) over the bones, meshes, materials and images as they are in memory: names, parents, poses,
/// vertices, triangles, weights, normals, texture coordinates, colours, textures.
[[nodiscard]] std::uint64_t content_hash(const Rig& rig);

}  // namespace layfigure::character
