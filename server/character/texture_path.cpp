#include "texture_path.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "text.h"

namespace layfigure::character {
namespace {

namespace fs = std::filesystem;

int hex_digit(char c) {
  if (std::isxdigit(static_cast<unsigned char>(c)) == 0) return -1;
  return c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10;
}

std::string percent_decoded(const std::string& uri) {
  std::string text;
  for (std::size_t at = 0; at < uri.size(); ++at) {
    const bool is_code =
        uri[at] == '%' && at + 2 < uri.size() && hex_digit(uri[at + 1]) >= 0 && hex_digit(uri[at + 2]) >= 0;
    text += is_code ? static_cast<char>(16 * hex_digit(uri[at + 1]) + hex_digit(uri[at + 2])) : uri[at];
    if (is_code) at += 2;
  }
  return text;
}

std::string with_slashes(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');
  return path;
}

}  // namespace

std::string texture_path(std::string path, const fs::path& folder, bool is_uri) {
  constexpr std::string_view kScheme = "file://";  // and no host
  if (is_uri) path = percent_decoded(path);
  path = with_slashes(std::move(path));
  if (path.starts_with(kScheme)) path.erase(0, kScheme.size());
  if (path.find("://") != std::string::npos) {
    make_readable(path);
    return path;
  }
  const fs::path whole = fs::path(path).lexically_normal();
  if (whole.is_absolute()) {
    const fs::path relative = whole.lexically_relative(folder.lexically_normal());
    path = relative.empty() || *relative.begin() == ".." ? whole.string() : relative.string();
  } else {
    path = whole.string();
  }
  make_readable(path);
  return path;
}

std::string base_name(std::string path) {
  path = fs::path(with_slashes(std::move(path))).filename().string();
  make_readable(path);
  return path;
}

}  // namespace layfigure::character
