#pragma once

#include <string>
#include <string_view>

namespace layfigure::character {

/// The bytes of a file whose name ends in `extension` (".gltf"), mended where they are sound but assimp 5.2 fails on
/// them; else as they are:
/// - Collada: white space before a text is dropped; assimp cannot read "<color>  0 0 0 1</color>". A skin without
///   bind_shape_matrix gets the one that it has by the format's rule, the identity; assimp takes zeros.
/// - glTF: a skin without inverseBindMatrices, on which assimp crashes, gets those that it has by the format's rule,
///   identities. Texture coordinates of 8 or 16 bits, which it reads as floats, become floats (gltf_coordinates.h).
/// Broken bytes stay so. O(bytes), and a few times their memory where a glTF is mended.
[[nodiscard]] std::string mend_source(std::string bytes, std::string_view extension);

}  // namespace layfigure::character
