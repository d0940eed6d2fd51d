#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>

namespace layfigure::character {

/// Gives meshes of a glTF document texture coordinates as floats where they are of 8 or 16 bits, which assimp 5.2 reads
/// as if they were floats. `binary` is what the file itself holds of buffers (a GLB's second chunk), or nothing;
/// coordinates that are elsewhere, sparse or out of its range are taken away from the meshes. Returns whether it has
/// changed anything.
bool make_coordinates_floats(nlohmann::json& document, std::string_view binary);

}  // namespace layfigure::character
