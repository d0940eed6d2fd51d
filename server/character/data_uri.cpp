#include "data_uri.h"

#include <array>
#include <cstdint>

namespace layfigure::character {

std::string data_uri(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string uri = "data:application/octet-stream;base64,";
  uri.reserve(uri.size() + (bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const auto byte = [&](std::size_t k) {
      return at + k < bytes.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + k])) : 0U;
    };
    const std::uint32_t bits = byte(0) << 16U | byte(1) << 8U | byte(2);
    std::array<char, 4> group{};
    for (unsigned k = 0; k < 4; ++k) group[k] = kDigits[bits >> (18U - 6U * k) & 63U];
    for (std::size_t k = bytes.size() - at; k < 3; ++k) group[k + 1] = '=';
    uri.append(group.data(), group.size());
  }
  return uri;
}

}  // namespace layfigure::character
