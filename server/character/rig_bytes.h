#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "companion.h"
#include "layfigure/character/rig.h"

namespace layfigure::character {

/// A rig that was imported, and the files that it was imported from.
struct ImportRecord {
  Rig rig;
  std::vector<Companion> companions;
  std::optional<cache::Digest> digest;  ///< of the character's own file, as it was read
};

/// A record as bytes, for the same program on the same machine.
[[nodiscard]] std::string to_bytes(const ImportRecord& record);

/// The record of to_bytes(). Throws std::runtime_error if the bytes are not one whole record, or if an index in its rig
/// (parent, corner of a triangle, bone of an influence, material, image) is out of range.
[[nodiscard]] ImportRecord from_bytes(std::string_view bytes);

}  // namespace layfigure::character
