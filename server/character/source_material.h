#pragma once

#include <assimp/scene.h>

#include <filesystem>

#include "source_scene.h"

namespace layfigure::character {

/// Adds all materials of the file to `scene`, in their order, and the pictures in the file that they use as base colour
/// textures. A glTF multiplies texture and colour; in the other formats a texture stands for the colour. The texture's
/// path is brought to the form of Material::texture; no file is looked at. Tells in the scene's warnings what cannot
/// be kept of those materials that meshes use: transforms of textures, pictures beyond kMostImageBytes, an opacity of 0
/// (apart from glTF's).
void add_materials(const aiScene& file, bool is_gltf, const std::filesystem::path& folder, SourceScene& scene);

/// Whether the mesh's material has a base colour texture.
[[nodiscard]] bool has_texture(const aiScene& file, const aiMesh& mesh);

/// The channel of texture coordinates that the base colour texture of the mesh's material goes by; 0 without a texture.
[[nodiscard]] unsigned texture_channel(const aiScene& file, const aiMesh& mesh);

}  // namespace layfigure::character
