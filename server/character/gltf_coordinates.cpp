#include "gltf_coordinates.h"

#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "data_uri.h"

namespace layfigure::character {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kUnsignedByte = 5121;  // component types
constexpr std::size_t kUnsignedShort = 5123;
constexpr std::size_t kFloat = 5126;

/// A count, an offset or an index; nothing where there is something else, or more than a file can hold.
std::optional<std::size_t> number(const Json& object, const char* name, std::optional<std::size_t> otherwise) {
  const auto found = object.find(name);
  if (found == object.end()) return otherwise;
  if (!found->is_number_unsigned() || found->get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
    return {};
  return found->get<std::size_t>();
}

/// An entry of one of the document's lists, if there is one.
const Json* entry(const Json& document, const char* list, std::optional<std::size_t> index) {
  const auto found = document.find(list);
  if (!index || found == document.end() || !found->is_array() || *index >= found->size()) return nullptr;
  const Json& item = (*found)[*index];
  return item.is_object() ? &item : nullptr;
}

/// The components of an accessor of pairs as floats, normalised if it says so; nothing if `binary` does not hold them.
std::optional<std::string> floats_of(const Json& document, const Json& accessor, std::size_t type,
                                     std::string_view binary) {
  const Json* view = entry(document, "bufferViews", number(accessor, "bufferView", {}));
  if (view == nullptr || accessor.contains("sparse")) return {};
  const Json* buffer = entry(document, "buffers", number(*view, "buffer", {}));
  if (buffer == nullptr || number(*view, "buffer", {}) != std::size_t{0} || buffer->contains("uri")) return {};
  const std::size_t width = type == kUnsignedByte ? 1 : 2;
  const auto count = number(accessor, "count", {});
  const auto start = number(*view, "byteOffset", 0);
  const auto offset = number(accessor, "byteOffset", 0);
  const auto stride = number(*view, "byteStride", 2 * width);
  if (!count || !start || !offset || !stride || *count == 0 || *stride < 2 * width) return {};
  if (*count > binary.size() || *start + *offset + *count * *stride > binary.size() + *stride - 2 * width) return {};
  const bool is_normalized = accessor.value("normalized", Json(false)) == Json(true);
  const float scale = !is_normalized ? 1.0F : 1.0F / (width == 1 ? 255.0F : 65535.0F);
  std::string floats;
  for (std::size_t k = 0; k < 2 * *count; ++k) {
    const std::size_t at = *start + *offset + k / 2 * *stride + k % 2 * width;
    unsigned value = static_cast<unsigned char>(binary[at]);
    if (width == 2) value |= static_cast<unsigned>(static_cast<unsigned char>(binary[at + 1])) << 8U;
    const float component = scale * static_cast<float>(value);
    floats.append(reinterpret_cast<const char*>(&component), sizeof component);
  }
  return floats;
}

/// Adds an accessor of pairs of floats, in a buffer of its own; returns its index.
std::size_t add_accessor(Json& document, const std::string& floats) {
  document["buffers"].push_back({{"byteLength", floats.size()}, {"uri", data_uri(floats)}});
  document["bufferViews"].push_back({{"buffer", document["buffers"].size() - 1}, {"byteLength", floats.size()}});
  document["accessors"].push_back({{"bufferView", document["bufferViews"].size() - 1},
                                   {"componentType", kFloat},
                                   {"count", floats.size() / (2 * sizeof(float))},
                                   {"type", "VEC2"}});
  return document["accessors"].size() - 1;
}

class Mender {
 public:
  Mender(Json& document, std::string_view binary) : document_(document), binary_(binary) {}

  /// Returns whether it has changed the attributes of a primitive.
  bool mend(Json& attributes) {
    bool changed = false;
    for (auto at = attributes.begin(); at != attributes.end();) {
      const bool is_meant = at.key().starts_with("TEXCOORD_") && at->is_number_unsigned() && is_short(*at);
      const std::optional<std::size_t> mended = is_meant ? accessor_for(at->get<std::size_t>()) : std::nullopt;
      if (mended) *at = *mended;
      at = is_meant && !mended ? attributes.erase(at) : std::next(at);
      changed = changed || is_meant;
    }
    return changed;
  }

 private:
  [[nodiscard]] bool is_short(const Json& index) const {
    const Json* accessor = entry(document_, "accessors", index.get<std::size_t>());
    const auto type = accessor != nullptr ? number(*accessor, "componentType", {}) : std::nullopt;
    return type == kUnsignedByte || type == kUnsignedShort;
  }

  /// That of floats for one of shorts; several meshes may share it.
  std::optional<std::size_t> accessor_for(std::size_t index) {
    const auto [known, is_new] = mended_.try_emplace(index);
    if (!is_new) return known->second;
    const Json& accessor = document_["accessors"][index];
    const auto floats = floats_of(document_, accessor, accessor["componentType"].get<std::size_t>(), binary_);
    if (floats) known->second = add_accessor(document_, *floats);
    return known->second;
  }

  Json& document_;
  std::string_view binary_;
  std::map<std::size_t, std::optional<std::size_t>> mended_;
};

}  // namespace

bool make_coordinates_floats(Json& document, std::string_view binary) {
  const auto meshes = document.is_object() ? document.find("meshes") : document.end();
  if (meshes == document.end() || !meshes->is_array()) return false;
  Mender mender(document, binary);
  bool changed = false;
  for (Json& mesh : *meshes) {
    if (!mesh.is_object() || !mesh.contains("primitives") || !mesh["primitives"].is_array()) continue;
    for (Json& primitive : mesh["primitives"]) {
      if (!primitive.is_object() || !primitive.contains("attributes") || !primitive["attributes"].is_object()) continue;
      changed = mender.mend(primitive["attributes"]) || changed;
    }
  }
  return changed;
}

}  // namespace layfigure::character
