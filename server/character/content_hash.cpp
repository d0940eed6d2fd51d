#include <bit>
#include <concepts>

#include "convert.h"

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

void add_mesh(const SkinnedMesh& mesh, Fnv1a& hash) {
  hash.add(mesh.name);
  hash.add(mesh.color);
  hash.add(mesh.vertices.size());
  for (const auto& vertex : mesh.vertices) hash.add(vertex);
  hash.add(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) hash.add(triangle);
  for (const auto& influences : mesh.influences) {
    hash.add(influences.size());
    for (const auto& influence : influences) {
      hash.add(influence.bone);
      hash.add(influence.weight);
    }
  }
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
  return hash.value();
}

}  // namespace layfigure::character
