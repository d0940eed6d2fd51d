#include "layfigure/app/mesh_chunks.h"

#include <algorithm>
#include <bit>
#include <layfigure/meshes_t.hpp>

#include "layfigure/messaging/protocol.h"

namespace layfigure::app {
namespace {

std::size_t most_influences(const character::SkinnedMesh& mesh) {
  std::size_t most = 0;
  for (const auto& influences : mesh.influences) most = std::max(most, influences.size());
  return most;
}

void add_influences(mesh_t& out, const std::vector<character::Influence>& influences) {
  std::vector<std::int32_t> joints(static_cast<std::size_t>(out.influence_count), 0);
  std::vector<float> weights(joints.size(), 0.0F);
  for (std::size_t i = 0; i < influences.size(); ++i) {
    joints[i] = influences[i].bone;
    weights[i] = static_cast<float>(influences[i].weight);
  }
  out.joint_indices.push_back(std::move(joints));
  out.joint_weights.push_back(std::move(weights));
}

std::string to_wire(character::Wrap wrap) {
  if (wrap == character::Wrap::kClamp) return "clamp";
  return wrap == character::Wrap::kMirror ? "mirror" : "repeat";
}

material_t make_material(const character::Material& material) {
  material_t out{};
  out.name = material.name;
  std::ranges::copy(material.base_color, out.base_color);
  out.opacity = material.opacity;
  out.texture_alpha = static_cast<std::int8_t>(material.texture_alpha);
  out.alpha_cutoff = material.alpha_cutoff;
  out.texture = material.texture;
  out.image = material.image;
  out.wrap_u = to_wire(material.wrap[0]);
  out.wrap_v = to_wire(material.wrap[1]);
  return out;
}

image_t make_image(const character::Image& image) {
  image_t out{};
  out.name = image.name;
  out.format = image.format;
  out.byte_count = static_cast<std::int32_t>(image.bytes.size());
  out.bytes.assign(image.bytes.begin(), image.bytes.end());
  return out;
}

void add_wedges(mesh_t& out, const character::Wedges& wedges) {
  out.normal_count = static_cast<std::int32_t>(wedges.normals.size());
  for (const Eigen::Vector3f& n : wedges.normals) out.normals.push_back({n.x(), n.y(), n.z()});
  out.uv_count = static_cast<std::int32_t>(wedges.uvs.size());
  for (const Eigen::Vector2f& uv : wedges.uvs) out.uvs.push_back({uv.x(), uv.y()});
  out.wedge_triangle_count = static_cast<std::int32_t>(wedges.triangles.size());
  for (const Eigen::Vector3i& t : wedges.triangles) out.wedge_triangles.push_back({t.x(), t.y(), t.z()});
}

mesh_t make_mesh(const character::SkinnedMesh& mesh) {
  mesh_t out{};
  out.name = mesh.name;
  out.material = mesh.material;
  out.vertex_count = static_cast<std::int32_t>(mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices) {
    out.points.push_back({static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
  }
  out.triangle_count = static_cast<std::int32_t>(mesh.triangles.size());
  for (const Eigen::Vector3i& t : mesh.triangles) out.triangles.push_back({t.x(), t.y(), t.z()});
  out.influence_count = static_cast<std::int32_t>(most_influences(mesh));
  for (const auto& influences : mesh.influences) add_influences(out, influences);
  add_wedges(out, mesh.wedges);
  return out;
}

}  // namespace

MeshChunks::MeshChunks(const character::Rig& rig) : content_hash_(std::bit_cast<std::int64_t>(rig.content_hash)) {
  meshes_t meshes{};
  meshes.content_hash = content_hash_;
  meshes.mesh_count = static_cast<std::int32_t>(rig.meshes.size());
  for (const character::SkinnedMesh& mesh : rig.meshes) meshes.meshes.push_back(make_mesh(mesh));
  meshes.material_count = static_cast<std::int32_t>(rig.materials.size());
  for (const character::Material& material : rig.materials) meshes.materials.push_back(make_material(material));
  meshes.image_count = static_cast<std::int32_t>(rig.images.size());
  for (const character::Image& image : rig.images) meshes.images.push_back(make_image(image));
  bytes_ = messaging::encode(meshes);
}

std::int32_t MeshChunks::total() const {
  return static_cast<std::int32_t>((bytes_.size() + messaging::kMeshChunkBytes - 1) / messaging::kMeshChunkBytes);
}

mesh_chunk_t MeshChunks::chunk(std::int32_t index) const {
  const std::size_t begin = static_cast<std::size_t>(index) * messaging::kMeshChunkBytes;
  const messaging::ByteView piece =
      messaging::ByteView(bytes_).subspan(begin, std::min(messaging::kMeshChunkBytes, bytes_.size() - begin));
  mesh_chunk_t message{};
  message.protocol_version = messaging::kProtocolVersion;
  message.content_hash = content_hash_;
  message.index = index;
  message.total = total();
  message.byte_count = static_cast<std::int32_t>(piece.size());
  message.bytes.assign(piece.begin(), piece.end());
  return message;
}

}  // namespace layfigure::app
