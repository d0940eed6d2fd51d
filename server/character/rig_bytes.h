#pragma once

#include <string>

#include "layfigure/character/rig.h"

namespace layfigure::character {

/// A rig as bytes, for another process of the same build on the same machine.
[[nodiscard]] std::string to_bytes(Rig rig);

/// The rig of to_bytes(). Throws std::runtime_error if the bytes are not one whole rig.
[[nodiscard]] Rig from_bytes(const std::string& bytes);

}  // namespace layfigure::character
