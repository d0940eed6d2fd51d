#pragma once

#include <filesystem>

namespace layfigure::character {

/// Throws ImportError unless `path` is a readable, non-empty file of a sane size and, by its name a GLB, has a GLB's
/// header and is as long as that says. Cheap: reads 12 bytes.
void check_file(const std::filesystem::path& path);

}  // namespace layfigure::character
