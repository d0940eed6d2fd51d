#pragma once

#include <string>
#include <string_view>

namespace layfigure::doll {

/// The shortest text that reads back as the same double, as TOML has it.
[[nodiscard]] std::string toml_number(double value);

/// With six digits, for messages and comments.
[[nodiscard]] std::string short_number(double value);

/// A quoted key that read as a pattern (name_pattern.h) matches `name`: the name itself, but for bytes that are not
/// UTF-8, which TOML does not allow: each stands as ?.
[[nodiscard]] std::string toml_key(std::string_view name);

/// The text fit for a comment: control characters and bytes that are not UTF-8 as ?.
[[nodiscard]] std::string toml_comment(std::string_view text);

}  // namespace layfigure::doll
