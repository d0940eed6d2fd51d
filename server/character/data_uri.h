#pragma once

#include <string>
#include <string_view>

namespace layfigure::character {

/// Bytes as a URI that holds them, "data:application/octet-stream;base64,..." (RFC 2397, RFC 4648).
[[nodiscard]] std::string data_uri(std::string_view bytes);

}  // namespace layfigure::character
