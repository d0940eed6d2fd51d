#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "companion.h"
#include "source_scene.h"

namespace layfigure::character {

/// What was read, and from which files.
struct Reading {
  SourceScene scene;
  std::optional<cache::Digest> digest;  ///< of the bytes of the character's own file
  std::vector<Companion> companions;
};

/// Reads a file of any format that assimp knows; with folder_io.h, fbx_limits.h and source_material.h the only place
/// that sees assimp. Looks at no file outside the character's folder. Throws std::runtime_error that says what is wrong
/// and the mend, or std::bad_alloc; but a broken file may also crash or hang it: call it in a process of its own.
[[nodiscard]] Reading read_source(const std::filesystem::path& path);

/// Names the library that reads: one of another version may read another scene.
[[nodiscard]] std::string reader_version();

}  // namespace layfigure::character
