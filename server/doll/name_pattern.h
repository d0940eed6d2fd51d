#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace layfigure::doll {

/// Whether the whole of `name` is as the pattern says: * stands for any characters or none, ? for any one character
/// (UTF-8), all others for themselves. O(pattern times name).
[[nodiscard]] bool matches(std::string_view pattern, std::string_view name);

/// Those of the names that the pattern may have meant, best first, at most three: its letters occur in them, or few
/// need to be changed. Upper and lower case and the pattern's * and ? make no difference. O(letters of all names).
[[nodiscard]] std::vector<std::string> near_names(std::string_view pattern, const std::vector<std::string>& names);

}  // namespace layfigure::doll
