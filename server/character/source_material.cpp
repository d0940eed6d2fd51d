#include "source_material.h"

#include <assimp/GltfMaterial.h>
#include <assimp/material.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "text.h"
#include "texture_path.h"

namespace layfigure::character {
namespace {

/// Where a material has its base colour texture, as assimp tells it.
struct Texture {
  aiTextureType type{aiTextureType_DIFFUSE};
  std::string reference;  ///< a path, or "*" and the number of a picture in the file
  unsigned channel{0};    ///< of texture coordinates
  std::array<aiTextureMapMode, 3> wrap{aiTextureMapMode_Wrap, aiTextureMapMode_Wrap, aiTextureMapMode_Wrap};
};

std::optional<Texture> base_color_texture(const aiMaterial& material) {
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    Texture texture;
    aiString reference;
    if (material.GetTexture(type, 0, &reference, nullptr, &texture.channel, nullptr, nullptr, texture.wrap.data()) !=
            AI_SUCCESS ||
        reference.length == 0) {
      continue;
    }
    texture.type = type;
    texture.reference = reference.C_Str();
    return texture;
  }
  return std::nullopt;
}

std::optional<Texture> texture_of(const aiScene& file, const aiMesh& mesh) {
  if (mesh.mMaterialIndex >= file.mNumMaterials) return std::nullopt;
  return base_color_texture(*file.mMaterials[mesh.mMaterialIndex]);
}

Wrap to_wrap(aiTextureMapMode mode) {
  if (mode == aiTextureMapMode_Mirror) return Wrap::kMirror;
  return mode == aiTextureMapMode_Clamp || mode == aiTextureMapMode_Decal ? Wrap::kClamp : Wrap::kRepeat;
}

Eigen::Vector3d base_color(const aiMaterial& material) {
  aiColor4D color(0.8F, 0.8F, 0.8F, 1.0F);
  if (material.Get(AI_MATKEY_BASE_COLOR, color) != AI_SUCCESS) material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
  const Eigen::Vector3d rgb(color.r, color.g, color.b);
  return rgb.allFinite() ? Eigen::Vector3d(rgb.cwiseMax(0.0).cwiseMin(1.0)) : Eigen::Vector3d::Constant(0.8);
}

/// Keeps the pictures of a file that are used, each once, as long as there is room.
class ImageList {
 public:
  ImageList(const aiScene& file, SourceScene& scene) : file_(file), scene_(scene) {}

  /// The picture's index in the scene's images, -1 if there is no room or no such picture.
  int add(const aiTexture& texture, int number) {
    const auto [entry, is_new] = index_of_.try_emplace(number, -1);
    if (!is_new) return entry->second;
    Image image = to_image(texture);
    if (image.bytes.empty()) return -1;
    if (image.bytes.size() > kMostImageBytes - used_) {
      scene_.warnings.push_back(
          "picture '" + image.name + "' in the file (" + std::to_string(image.bytes.size() >> 20U) +
          " MB) is left out: more than 32 MB of pictures; keep it in a file beside the character");
      return -1;
    }
    used_ += image.bytes.size();
    scene_.images.push_back(std::move(image));
    return entry->second = static_cast<int>(scene_.images.size()) - 1;
  }
  [[nodiscard]] std::pair<const aiTexture*, int> find(const std::string& reference) const {
    return file_.GetEmbeddedTextureAndIndex(reference.c_str());
  }

 private:
  static Image to_image(const aiTexture& texture);

  const aiScene& file_;
  SourceScene& scene_;
  std::map<int, int> index_of_;  // by its number in the file
  std::size_t used_{0};          // [bytes]
};

/// Blue, green, red, alpha from the upper left corner on, as a Truevision TGA file: the one format that is a header and
/// just these bytes.
std::string tga_of(const aiTexture& texture) {
  constexpr unsigned kLargest = 0xFFFF;
  if (texture.mWidth == 0 || texture.mWidth > kLargest || texture.mHeight > kLargest) return {};
  constexpr char kTrueColor = 2;
  constexpr char kBits = 32;
  constexpr char kFromTopWithAlpha = 0x28;
  std::string bytes(12, '\0');
  bytes[2] = kTrueColor;
  for (const unsigned side : {texture.mWidth, texture.mHeight}) {
    bytes += static_cast<char>(side & 0xFFU);
    bytes += static_cast<char>(side >> 8U);
  }
  bytes += {kBits, kFromTopWithAlpha};
  const std::size_t pixels = static_cast<std::size_t>(texture.mWidth) * texture.mHeight;
  return bytes.append(reinterpret_cast<const char*>(texture.pcData), pixels * sizeof(aiTexel));
}

std::string format_of(std::string_view bytes, std::string hint) {
  if (bytes.starts_with("\x89PNG")) return "png";
  if (bytes.starts_with("\xFF\xD8\xFF")) return "jpg";
  make_readable(hint);
  return hint;
}

Image ImageList::to_image(const aiTexture& texture) {
  Image image;
  image.name = base_name(texture.mFilename.C_Str());
  if (texture.pcData == nullptr) return image;
  if (texture.mHeight > 0) {
    image.bytes = tga_of(texture);
    image.format = "tga";
  } else {
    image.bytes.assign(reinterpret_cast<const char*>(texture.pcData), texture.mWidth);
    image.format = format_of(image.bytes, texture.achFormatHint);
  }
  return image;
}

bool is_transformed(const aiMaterial& material, aiTextureType type) {
  aiUVTransform transform;
  if (material.Get(AI_MATKEY_UVTRANSFORM(type, 0), transform) != AI_SUCCESS) return false;
  constexpr float kRounding = 1e-5F;  // of a glTF's transform, which assimp turns about another point
  const auto differs = [](float a, float b) { return !(std::abs(a - b) <= kRounding); };
  return differs(transform.mTranslation.x, 0.0F) || differs(transform.mTranslation.y, 0.0F) ||
         differs(transform.mScaling.x, 1.0F) || differs(transform.mScaling.y, 1.0F) ||
         differs(transform.mRotation, 0.0F);
}

double opacity_of(const aiMaterial& file) {
  float opacity = 1.0F;
  file.Get(AI_MATKEY_OPACITY, opacity);
  return std::isfinite(opacity) ? std::clamp(static_cast<double>(opacity), 0.0, 1.0) : 1.0;
}

/// How a glTF's material uses alpha: not at all, unless it says so.
void read_gltf_alpha(const aiMaterial& file, Material& material) {
  aiString mode("OPAQUE");
  file.Get(AI_MATKEY_GLTF_ALPHAMODE, mode);
  const std::string_view name = mode.C_Str();
  if (name != "MASK" && name != "BLEND") return;
  material.opacity = opacity_of(file);
  material.texture_alpha = true;
  if (name != "MASK") return;
  float cutoff = 0.5F;  // the format's default
  file.Get(AI_MATKEY_GLTF_ALPHACUTOFF, cutoff);
  material.alpha_cutoff = std::isfinite(cutoff) ? std::clamp(static_cast<double>(cutoff), 0.0, 1.0) : 0.5;
}

/// Elsewhere the base colour texture's alpha counts if it is the opacity's texture too, or is said to.
void read_texture_alpha(const aiMaterial& file, const Texture& texture, Material& material) {
  aiString opacity;
  int flags = 0;
  file.Get(AI_MATKEY_TEXFLAGS(texture.type, 0), flags);
  const bool is_opacity =
      file.GetTexture(aiTextureType_OPACITY, 0, &opacity) == AI_SUCCESS && texture.reference == opacity.C_Str();
  material.texture_alpha = is_opacity || (static_cast<unsigned>(flags) & aiTextureFlags_UseAlpha) != 0;
}

/// What exporters write as an opacity of 0 has several meanings, of which invisible is the least likely.
void read_opacity(const aiMaterial& file, Material& material, std::vector<std::string>& warnings) {
  material.opacity = opacity_of(file);
  if (material.opacity > 0.0) return;
  warnings.push_back("material '" + material.name + "' has an opacity of 0: taken as opaque");
  material.opacity = 1.0;
}

class MaterialReader {
 public:
  MaterialReader(const aiScene& file, bool is_gltf, const std::filesystem::path& folder, SourceScene& scene)
      : is_gltf_(is_gltf), folder_(folder), scene_(scene), images_(file, scene) {}

  [[nodiscard]] Material read(const aiMaterial& file) {
    Material material;
    aiString name;
    file.Get(AI_MATKEY_NAME, name);
    material.name = name.C_Str();
    make_readable(material.name);
    material.base_color = base_color(file);
    if (is_gltf_) {
      read_gltf_alpha(file, material);
    } else {
      read_opacity(file, material, scene_.warnings);
    }
    if (const auto texture = base_color_texture(file)) add_texture(file, *texture, material);
    return material;
  }

 private:
  void add_texture(const aiMaterial& file, const Texture& texture, Material& material) {
    const auto [picture, number] = images_.find(texture.reference);
    if (picture != nullptr) {
      material.image = images_.add(*picture, number);
    } else if (texture.reference[0] != '*') {
      material.texture = texture_path(texture.reference, folder_, is_gltf_);
    }
    if (material.image < 0 && material.texture.empty()) return;
    for (std::size_t k = 0; k < material.wrap.size(); ++k) material.wrap[k] = to_wrap(texture.wrap[k]);
    if (!is_gltf_) {
      read_texture_alpha(file, texture, material);
      material.base_color = Eigen::Vector3d::Ones();
    }
    if (is_transformed(file, texture.type)) {
      scene_.warnings.push_back("material '" + material.name +
                                "' moves, turns or scales its texture: that is left out");
    }
  }

  bool is_gltf_;
  std::filesystem::path folder_;
  SourceScene& scene_;
  ImageList images_;
};

}  // namespace

void add_materials(const aiScene& file, bool is_gltf, const std::filesystem::path& folder, SourceScene& scene) {
  std::set<int> used;
  for (const SourceMesh& mesh : scene.meshes) used.insert(mesh.material);
  MaterialReader reader(file, is_gltf, folder, scene);
  for (int index = 0; index < static_cast<int>(file.mNumMaterials); ++index) {
    scene.materials.push_back(used.contains(index) ? reader.read(*file.mMaterials[index]) : Material{});
  }
}

bool has_texture(const aiScene& file, const aiMesh& mesh) { return texture_of(file, mesh).has_value(); }

unsigned texture_channel(const aiScene& file, const aiMesh& mesh) {
  const auto texture = texture_of(file, mesh);
  return texture && mesh.HasTextureCoords(texture->channel) ? texture->channel : 0;
}

}  // namespace layfigure::character
