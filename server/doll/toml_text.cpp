#include "toml_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace layfigure::doll {
namespace {

bool continues_character(unsigned char c) { return (c & 0xC0U) == 0x80U; }

/// Bytes of the character at `at` if it is well-formed UTF-8 (Unicode 15, table 3-7), else 0.
std::size_t character_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t k) {
    return at + k < text.size() ? static_cast<unsigned char>(text[at + k]) : static_cast<unsigned char>(0);
  };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if (!continues_character(byte(k))) return 0;
  }
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool no_character = (first == 0xED && byte(1) > 0x9F) || (first == 0xF4 && byte(1) > 0x8F);
  return overlong || no_character ? 0 : length;
}

/// Calls `good` with each well-formed character, `bad` for each group of bytes that is none.
template <class Good, class Bad>
void for_each_character(std::string_view text, Good good, Bad bad) {
  for (std::size_t at = 0; at < text.size();) {
    if (const std::size_t length = character_length(text, at); length > 0) {
      good(text.substr(at, length));
      at += length;
    } else {
      bad();
      ++at;
      while (at < text.size() && continues_character(static_cast<unsigned char>(text[at]))) ++at;
    }
  }
}

bool is_control(std::string_view character) {
  const auto c = static_cast<unsigned char>(character[0]);
  return c < 0x20 || c == 0x7F;
}

std::string escaped(std::string_view character) {
  if (character == "\"" || character == "\\") return std::string("\\").append(character);
  if (!is_control(character)) return std::string(character);
  std::array<char, 8> code{};
  std::snprintf(code.data(), code.size(), "\\u%04X", static_cast<unsigned>(static_cast<unsigned char>(character[0])));
  return code.data();
}

}  // namespace

std::string toml_number(double value) {
  if (!std::isfinite(value)) return value > 0.0 ? "inf" : value < 0.0 ? "-inf" : "nan";
  std::array<char, 32> digits{};  // the longest double has 24
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  std::string text(digits.data(), end);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string short_number(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string toml_key(std::string_view name) {
  std::string key = "\"";
  for_each_character(
      name, [&](std::string_view character) { key += escaped(character); }, [&] { key += '?'; });
  return key + "\"";
}

std::string toml_comment(std::string_view text) {
  std::string comment;
  for_each_character(
      text, [&](std::string_view character) { comment += is_control(character) ? "?" : std::string(character); },
      [&] { comment += '?'; });
  return comment;
}

}  // namespace layfigure::doll
