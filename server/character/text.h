#pragma once

#include <string>

namespace layfigure::character {

/// Makes a name of a file valid UTF-8 without control characters: bytes that are not UTF-8 are taken as Latin-1,
/// control characters become '_'. True if that changed it.
bool make_readable(std::string& name);

/// A message of at most kLongestMessage bytes in one line of printable characters, whatever a library put into it.
[[nodiscard]] std::string one_line(std::string text);

inline constexpr std::size_t kLongestMessage = 500;

}  // namespace layfigure::character
