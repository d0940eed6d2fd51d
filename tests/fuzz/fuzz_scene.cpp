// libFuzzer's target: the bytes become a scene as a format's reader may deliver it, and the scene a rig.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "convert.h"
#include "rig_bytes.h"
#include "unbound_skin.h"

namespace {

using namespace layfigure::character;

/// Takes numbers from the fuzzer's bytes; 0 when they are used up.
class Bytes {
 public:
  explicit Bytes(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T take() {
    T value{};
    const std::size_t count = std::min(sizeof value, bytes_.size());
    std::memcpy(&value, bytes_.data(), count);
    bytes_.remove_prefix(count);
    return value;
  }
  /// In [0, count), count > 0.
  int index(int count) { return take<std::uint8_t>() % count; }
  /// Mostly small and whole; now and then any float at all.
  double number() {
    const auto kind = take<std::int8_t>();
    return kind == INT8_MIN ? static_cast<double>(take<float>()) : kind / 16.0;
  }

 private:
  std::string_view bytes_;
};

Eigen::Affine3d take_pose(Bytes& bytes) {
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
  const std::uint8_t parts = bytes.take<std::uint8_t>();
  if ((parts & 1U) != 0U) pose.translation() << bytes.number(), bytes.number(), bytes.number();
  if ((parts & 2U) != 0U) {
    for (double& entry : pose.linear().reshaped()) entry = bytes.number();
  }
  return pose;
}

/// Normals, texture coordinates and material, each there or not; `vertices` of them.
void take_looks(Bytes& bytes, int vertices, int materials, SourceMesh& mesh) {
  const auto parts = bytes.take<std::uint8_t>();
  mesh.material = bytes.index(materials + 1) - 1;
  for (int v = 0; v < vertices && (parts & 1U) != 0U; ++v) {
    mesh.normals.emplace_back(bytes.number(), bytes.number(), bytes.number());
  }
  for (int v = 0; v < vertices && (parts & 2U) != 0U; ++v) {
    mesh.uvs.emplace_back(static_cast<float>(bytes.number()), static_cast<float>(bytes.number()));
  }
}

void take_materials(Bytes& bytes, SourceScene& scene) {
  for (int i = bytes.index(3); i > 0; --i) scene.images.push_back({"", "png", std::string(i, 'p')});
  for (int m = bytes.index(4); m > 0; --m) {
    Material material;
    material.image = bytes.index(static_cast<int>(scene.images.size()) + 1) - 1;
    scene.materials.push_back(std::move(material));
  }
}

SourceMesh take_mesh(Bytes& bytes, int nodes, int materials) {
  SourceMesh mesh;
  mesh.name = std::string(1, static_cast<char>('a' + bytes.index(4)));
  mesh.node = bytes.index(nodes);
  const int vertices = 1 + bytes.index(12);
  for (int v = 0; v < vertices; ++v) mesh.vertices.emplace_back(bytes.number(), bytes.number(), bytes.number());
  take_looks(bytes, vertices, materials, mesh);
  for (int t = bytes.index(12); t > 0; --t) {
    mesh.triangles.emplace_back(bytes.index(vertices), bytes.index(vertices), bytes.index(vertices));
  }
  for (int j = bytes.index(5); j > 0; --j) {
    SourceJoint joint;
    joint.node = bytes.index(nodes);
    joint.offset = take_pose(bytes);
    for (int w = bytes.index(8); w > 0; --w) joint.weights.push_back({bytes.index(vertices), bytes.number()});
    mesh.joints.push_back(std::move(joint));
  }
  return mesh;
}

SourceScene take_scene(Bytes& bytes) {
  SourceScene scene;
  const int nodes = 1 + bytes.index(10);
  for (int n = 0; n < nodes; ++n) {
    SourceNode node;
    node.name = std::string(static_cast<std::size_t>(bytes.index(2)), static_cast<char>('a' + bytes.index(4)));
    if (bytes.index(8) == 0) node.name += "_$AssimpFbx$_Rotation";
    node.parent = n == 0 ? -1 : bytes.index(n);
    const Eigen::Affine3d local = take_pose(bytes);
    if (bytes.index(4) == 0) node.limits.emplace().lower.x() = bytes.number();
    node.pose = n == 0 ? local : scene.nodes[node.parent].pose * local;
    scene.nodes.push_back(std::move(node));
  }
  take_materials(bytes, scene);
  for (int m = bytes.index(4); m > 0; --m) {
    scene.meshes.push_back(take_mesh(bytes, nodes, static_cast<int>(scene.materials.size())));
    scene.nodes[scene.meshes.back().node].has_object = true;
  }
  scene.world_from_file = take_pose(bytes);
  scene.metres_per_unit = bytes.index(2) == 0 ? 1.0 : 0.01;
  scene.unit_is_stated = bytes.index(2) == 0;
  scene.skin_replaces_node = bytes.index(2) == 0;
  return scene;
}

void require(bool condition, int line = __builtin_LINE()) {
  if (condition) return;
  std::cerr << "fuzz_scene: what line " << line << " requires does not hold\n";
  std::abort();
}

/// Indices are in range, and nothing is there that no mesh uses.
void check_materials(const Rig& rig) {
  std::vector<bool> used(rig.materials.size(), false);
  for (const SkinnedMesh& mesh : rig.meshes) {
    require(mesh.material >= -1 && mesh.material < static_cast<int>(rig.materials.size()));
    if (mesh.material >= 0) used[mesh.material] = true;
  }
  for (const bool is_used : used) require(is_used);
  for (const Material& material : rig.materials) {
    require(material.image >= -1 && material.image < static_cast<int>(rig.images.size()));
  }
}

/// Wedges are of the vertices of their corners, with unit normals.
void check_wedges(const SkinnedMesh& mesh) {
  const Wedges& wedges = mesh.wedges;
  const std::size_t count = std::max(wedges.normals.size(), wedges.uvs.size());
  require(wedges.normals.empty() || wedges.normals.size() == count);
  require(wedges.uvs.empty() || wedges.uvs.size() == count);
  require(count == 0 || count >= mesh.vertices.size());
  require(wedges.triangles.empty() || wedges.triangles.size() == mesh.triangles.size());
  require(count <= mesh.vertices.size() || !wedges.triangles.empty());
  for (const auto& normal : wedges.normals) require(std::abs(normal.norm() - 1.0F) < 1e-5F);
  for (std::size_t t = 0; t < wedges.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int wedge = wedges.triangles[t][k];
      require(wedge >= 0 && wedge < static_cast<int>(count));
      require(wedge >= static_cast<int>(mesh.vertices.size()) || wedge == mesh.triangles[t][k]);
    }
  }
}

/// What import_rig() promises of every rig.
void check(const Rig& rig) {
  require(!rig.bones.empty() && !rig.meshes.empty());
  for (std::size_t b = 0; b < rig.bones.size(); ++b) {
    const Bone& bone = rig.bones[b];
    require(bone.parent == -1 ? b == 0 : bone.parent >= 0 && bone.parent < static_cast<int>(b));
    require(!bone.name.empty() && bone.bind.matrix().allFinite() && bone.rest.matrix().allFinite());
    require(!bone.limits || bone.parent >= 0);
    require((bone.bind.linear().transpose() * bone.bind.linear()).isIdentity(1e-9));
  }
  for (const SkinnedMesh& mesh : rig.meshes) {
    require(!mesh.name.empty() && mesh.influences.size() == mesh.vertices.size());
    for (const auto& vertex : mesh.vertices) require(vertex.allFinite());
    check_wedges(mesh);
    for (const auto& list : mesh.influences) {
      double total = 0.0;
      for (const Influence& influence : list) total += influence.weight;
      require(!list.empty() && std::abs(total - 1.0) < 1e-12);
    }
  }
  check_materials(rig);
  const std::string bytes = to_bytes({rig, {}, {}});
  require(to_bytes(from_bytes(bytes)) == bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes({reinterpret_cast<const char*>(data), size});
  SourceScene scene = take_scene(bytes);
  bind_unbound_skins(scene);
  Rig rig;
  try {
    rig = convert(scene);
  } catch (const std::runtime_error&) {
    return 0;
  }
  check(rig);
  return 0;
}
