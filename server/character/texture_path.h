#pragma once

#include <filesystem>
#include <string>

namespace layfigure::character {

/// Brings a texture's path, as a file in `folder` (absolute) names it, to the form of Material::texture: UTF-8 without
/// control characters, '/' between folders, no "file://", relative to `folder` if it is below; percent-encoded
/// characters are decoded if `is_uri`. Text alone: whether there is such a file is not looked at.
[[nodiscard]] std::string texture_path(std::string path, const std::filesystem::path& folder, bool is_uri);

/// The last part of a path, made readable.
[[nodiscard]] std::string base_name(std::string path);

}  // namespace layfigure::character
