#include "text.h"

#include <cctype>
#include <string_view>

namespace layfigure::character {
namespace {

/// Bytes of the UTF-8 character that `text` begins with; 0 if it begins with none.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const auto continues = [&](std::size_t k) { return k < text.size() && (byte(k) & 0xC0U) == 0x80U; };
  if (byte(0) < 0x80U) return 1;
  if (byte(0) < 0xC2U) return 0;  // a continuation, or a longer spelling than needed
  if (byte(0) < 0xE0U) return continues(1) ? 2 : 0;
  if (!continues(1) || !continues(2)) return 0;
  if (byte(0) < 0xF0U) {
    const bool too_long = byte(0) == 0xE0U && byte(1) < 0xA0U;
    const bool surrogate = byte(0) == 0xEDU && byte(1) >= 0xA0U;
    return too_long || surrogate ? 0 : 3;
  }
  if (byte(0) > 0xF4U || !continues(3)) return 0;
  const bool too_long = byte(0) == 0xF0U && byte(1) < 0x90U;
  const bool too_large = byte(0) == 0xF4U && byte(1) >= 0x90U;
  return too_long || too_large ? 0 : 4;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string utf8_from_latin1(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80U) {
      result += c;
    } else {
      result += static_cast<char>(0xC0U | byte >> 6U);
      result += static_cast<char>(0x80U | (byte & 0x3FU));
    }
  }
  return result;
}

bool is_control(char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; }

}  // namespace

bool make_readable(std::string& name) {
  std::string readable = is_utf8(name) ? name : utf8_from_latin1(name);
  for (char& c : readable) {
    if (is_control(c)) c = '_';
  }
  if (readable == name) return false;
  name = std::move(readable);
  return true;
}

std::string one_line(std::string text) {
  for (char& c : text) {
    if (is_control(c)) c = ' ';
  }
  if (text.size() > kLongestMessage) {
    text.resize(kLongestMessage);
    while (!text.empty() && !is_utf8(text) && text.size() > kLongestMessage - 4) text.pop_back();
    text += "...";
  }
  if (!is_utf8(text)) text = utf8_from_latin1(text);
  return text;
}

}  // namespace layfigure::character
