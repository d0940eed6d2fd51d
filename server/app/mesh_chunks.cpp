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

mesh_t make_mesh(const character::SkinnedMesh& mesh) {
  mesh_t out{};
  out.name = mesh.name;
  std::ranges::copy(mesh.color, out.color);
  out.vertex_count = static_cast<std::int32_t>(mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices) {
    out.points.push_back({static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
  }
  out.triangle_count = static_cast<std::int32_t>(mesh.triangles.size());
  for (const Eigen::Vector3i& t : mesh.triangles) out.triangles.push_back({t.x(), t.y(), t.z()});
  out.influence_count = static_cast<std::int32_t>(most_influences(mesh));
  for (const auto& influences : mesh.influences) add_influences(out, influences);
  return out;
}

}  // namespace

MeshChunks::MeshChunks(const character::Rig& rig) : content_hash_(std::bit_cast<std::int64_t>(rig.content_hash)) {
  meshes_t meshes{};
  meshes.content_hash = content_hash_;
  meshes.mesh_count = static_cast<std::int32_t>(rig.meshes.size());
  for (const character::SkinnedMesh& mesh : rig.meshes) meshes.meshes.push_back(make_mesh(mesh));
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
