#pragma once

#include <filesystem>
#include <string>

#include "layfigure/cache/digest.h"

namespace layfigure::character {

/// A file beside the character's that its reader asked for: buffers, materials, a skeleton.
struct Companion {
  enum class Use : int { kAbsent, kSeen, kRead };  // looked for in vain; found, not opened; read

  std::string path;  ///< from the character's folder
  Use use{Use::kAbsent};
  cache::Digest digest;  ///< of its bytes, if it was read
};

/// Whether a reader that asks for it again will find the same.
[[nodiscard]] bool is_unchanged(const Companion& companion, const std::filesystem::path& folder);

}  // namespace layfigure::character
