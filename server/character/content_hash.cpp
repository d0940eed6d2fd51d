#include <bit>
#include <concepts>

#include "convert.h"
#include "layfigure/cache/digest.h"

namespace layfigure::character {
namespace {

class Fnv1a {
 public:
  void add(std::uint64_t value) {
    for (int byte = 0; byte < 8; ++byte) {
      hash_ = (hash_ ^ (value >> (8 * byte) & 0xFFU)) * 0x100000001B3ULL;
    }
  }
  void add(std::integral auto value) { add(static_cast<std::uint64_t>(value)); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value + 0.0)); }  // -0 and 0 are equal
  void add(const std::string& text) {
    add(text.size());
    for (const char c : text) add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  }
  template <class Derived>
  void add(const Eigen::DenseBase<Derived>& matrix) {
    for (int column = 0; column < matrix.cols(); ++column) {
      for (int row = 0; row < matrix.rows(); ++row) add(matrix.derived()(row, column));
    }
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_{0xCBF29CE484222325ULL};
};

template <class Values>
void add_all(const Values& values, Fnv1a& hash) {
  hash.add(values.size());
  for (const auto& value : values) hash.add(value);
}

void add_mesh(const SkinnedMesh& mesh, Fnv1a& hash) {
  hash.add(mesh.name);
  hash.add(mesh.material);
  add_all(mesh.vertices, hash);
  add_all(mesh.triangles, hash);
  for (const auto& influences : mesh.influences) {
    hash.add(influences.size());
    for (const auto& influence : influences) {
      hash.add(influence.bone);
      hash.add(influence.weight);
    }
  }
  add_all(mesh.wedges.normals, hash);
  add_all(mesh.wedges.uvs, hash);
  add_all(mesh.wedges.triangles, hash);
}

void add_material(const Material& material, Fnv1a& hash) {
  hash.add(material.name);
  hash.add(material.base_color);
  hash.add(material.opacity);
  hash.add(material.texture_alpha);
  hash.add(material.alpha_cutoff);
  hash.add(material.texture);
  hash.add(material.image);
  for (const Wrap wrap : material.wrap) hash.add(static_cast<int>(wrap));
}

void add_image(const Image& image, Fnv1a& hash) {
  hash.add(image.name);
  hash.add(image.format);
  const cache::Digest digest = cache::digest_of(image.bytes);  // far quicker over megabytes
  hash.add(digest.high);
  hash.add(digest.low);
}

void add_limits(const BoneLimits& limits, Fnv1a& hash) {
  hash.add(limits.axes.coeffs());
  hash.add(limits.reference.coeffs());
  hash.add(limits.lower);
  hash.add(limits.upper);
}

}  // namespace

std::uint64_t content_hash(const Rig& rig) {
  Fnv1a hash;
  hash.add(rig.bones.size());
  for (const Bone& bone : rig.bones) {
    hash.add(bone.name);
    hash.add(bone.parent);
    hash.add(bone.rest.matrix());
    hash.add(bone.bind.matrix());
    if (bone.limits) add_limits(*bone.limits, hash);
  }
  hash.add(rig.meshes.size());
  for (const SkinnedMesh& mesh : rig.meshes) add_mesh(mesh, hash);
  hash.add(rig.materials.size());
  for (const Material& material : rig.materials) add_material(material, hash);
  hash.add(rig.images.size());
  for (const Image& image : rig.images) add_image(image, hash);
  return hash.value();
}

}  // namespace layfigure::character
