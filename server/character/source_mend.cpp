#include "source_mend.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "data_uri.h"
#include "gltf_coordinates.h"

namespace layfigure::character {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kGlbHeader = 12;    // [bytes]: magic, version, length
constexpr std::size_t kChunkHeader = 8;   // [bytes]: length, type
constexpr std::size_t kMatrixBytes = 64;  // 16 floats

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// Drops the white space between a tag and a text; that between two tags stays, as it does no harm.
std::string without_space_before_texts(std::string text) {
  std::size_t kept = 0;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[kept++] = text[at++];
    if (c != '>') continue;
    std::size_t next = at;
    while (next < text.size() && is_space(text[next])) ++next;
    if (next < text.size() && text[next] != '<') at = next;
  }
  text.resize(kept);
  return text;
}

/// Gives each skin its bind_shape_matrix, which is the first of what a skin holds.
std::string with_bind_shapes(const std::string& text) {
  constexpr std::string_view kSkin = "<skin ";
  constexpr std::string_view kMatrix = "<bind_shape_matrix";
  constexpr std::string_view kIdentity = "<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>";
  std::string result;
  std::size_t copied = 0;
  for (std::size_t at = text.find(kSkin); at != std::string::npos; at = text.find(kSkin, at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) break;
    std::size_t next = end + 1;
    while (next < text.size() && is_space(text[next])) ++next;
    if (text[end - 1] == '/' || text.compare(next, kMatrix.size(), kMatrix) == 0) continue;
    result.append(text, copied, end + 1 - copied).append(kIdentity);
    copied = end + 1;
  }
  return copied == 0 ? text : result.append(text, copied, std::string::npos);
}

std::size_t count_of(std::string_view text, std::string_view word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + word.size())) ++count;
  return count;
}

/// Every skin has "joints", and only skins do.
bool may_lack_binds(std::string_view json) {
  return count_of(json, "\"joints\"") > count_of(json, "\"inverseBindMatrices\"");
}

std::string identities(std::size_t count) {
  std::string bytes(count * kMatrixBytes, '\0');
  for (std::size_t matrix = 0; matrix < count; ++matrix) {
    for (std::size_t k = 0; k < 4; ++k) {
      const float one = 1.0F;
      std::memcpy(bytes.data() + matrix * kMatrixBytes + 5 * k * sizeof one, &one, sizeof one);
    }
  }
  return bytes;
}

/// Adds one accessor of identities for all skins that have none. False, and nothing changed, if there is none such, or
/// the document is not what it should be.
bool add_missing_binds(Json& document) {
  const auto is_array = [&](const char* name) { return document.contains(name) && document[name].is_array(); };
  if (!document.is_object() || !is_array("skins") || !is_array("buffers") || !is_array("bufferViews") ||
      !is_array("accessors")) {
    return false;
  }
  std::size_t most_joints = 0;
  for (const Json& skin : document["skins"]) {
    const bool lacks = skin.is_object() && skin.contains("joints") && skin["joints"].is_array() &&
                       !skin.contains("inverseBindMatrices");
    if (lacks) most_joints = std::max(most_joints, skin["joints"].size());
  }
  if (most_joints == 0) return false;
  const std::string matrices = identities(most_joints);
  document["buffers"].push_back({{"byteLength", matrices.size()}, {"uri", data_uri(matrices)}});
  document["bufferViews"].push_back({{"buffer", document["buffers"].size() - 1}, {"byteLength", matrices.size()}});
  constexpr int kFloat = 5126;
  document["accessors"].push_back({{"bufferView", document["bufferViews"].size() - 1},
                                   {"componentType", kFloat},
                                   {"count", most_joints},
                                   {"type", "MAT4"}});
  for (Json& skin : document["skins"]) {
    if (skin.is_object() && !skin.contains("inverseBindMatrices")) {
      skin["inverseBindMatrices"] = document["accessors"].size() - 1;
    }
  }
  return true;
}

bool has_texture_coordinates(std::string_view json) { return json.find("\"TEXCOORD_") != std::string_view::npos; }

/// The document with what assimp needs, or nothing if it is to stay. `binary`: of the buffers, what the file holds.
std::string mended_document(std::string_view text, std::string_view binary) {
  if (!may_lack_binds(text) && !has_texture_coordinates(text)) return {};
  Json document = Json::parse(text, nullptr, false);
  if (document.is_discarded()) return {};
  const bool lacked_binds = add_missing_binds(document);
  const bool had_shorts = make_coordinates_floats(document, binary);
  if (!lacked_binds && !had_shorts) return {};
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::uint32_t read_number(const std::string& bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t k = 4; k-- > 0;) number = number << 8U | static_cast<unsigned char>(bytes[at + k]);
  return number;
}

void append_number(std::size_t number, std::string& bytes) {
  for (unsigned shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift & 0xFFU);
}

std::string mend_glb(std::string bytes) {
  constexpr std::size_t kText = kGlbHeader + kChunkHeader;
  if (bytes.size() < kText) return bytes;
  const std::size_t length = read_number(bytes, kGlbHeader);
  if (length > bytes.size() - kText) return bytes;
  const std::string_view rest = std::string_view(bytes).substr(kText + length);
  const std::string_view binary = rest.substr(std::min(rest.size(), kChunkHeader));
  std::string text = mended_document(std::string_view(bytes).substr(kText, length), binary);
  if (text.empty()) return bytes;
  text.resize((text.size() + 3) / 4 * 4, ' ');  // chunks are aligned to 4 bytes
  std::string mended = bytes.substr(0, kGlbHeader - 4);
  append_number(bytes.size() - length + text.size(), mended);
  append_number(text.size(), mended);
  mended.append(bytes, kGlbHeader + 4, 4).append(text).append(bytes, kText + length);
  return mended;
}

}  // namespace

std::string mend_source(std::string bytes, std::string_view extension) {
  std::string ending(extension);
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending == ".dae") return with_bind_shapes(without_space_before_texts(std::move(bytes)));
  if (ending == ".glb") return mend_glb(std::move(bytes));
  if (ending != ".gltf") return bytes;
  std::string mended = mended_document(bytes, {});
  return mended.empty() ? bytes : mended;
}

}  // namespace layfigure::character
